"""Opens a curtain's .glb in Blender and compares its poses with the file's own numbers.

    python blender.py curtain.glb [picture.png]

needs `pip install bpy numpy` (or `blender -b -P blender.py -- curtain.glb`).
"""
import sys

import bpy
import numpy as np

args = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=args[0])
mesh = next(o for o in bpy.data.objects if o.type == "MESH")
keys = mesh.data.shape_keys.key_blocks
scene = bpy.context.scene
curves = mesh.data.shape_keys.animation_data.action
print(f"Blender {bpy.app.version_string}: {len(mesh.data.vertices)} vertices, {len(keys) - 1} shape keys, action {curves.name}")


def pose():
    graph = bpy.context.evaluated_depsgraph_get()
    posed = mesh.evaluated_get(graph).to_mesh()
    out = np.empty(3 * len(posed.vertices), np.float32)
    posed.vertices.foreach_get("co", out)
    return out.reshape(-1, 3)


def key(n):
    out = np.empty(3 * len(mesh.data.vertices), np.float32)
    keys[n].data.foreach_get("co", out)
    return out.reshape(-1, 3)


fps = scene.render.fps / scene.render.fps_base
worst = 0.0
count = len(keys) - 1
clip_fps = float(mesh.data.get("woven", {}).get("fps", fps)) if "woven" in mesh.data else fps
for n in {0, count // 2, count - 1}:
    at = n / clip_fps * fps
    scene.frame_set(int(at), subframe=at - int(at))
    worst = max(worst, float(np.abs(pose() - key(n + 1)).max()))
print(f"largest difference between the pose played and the frame stored: {worst:.2e} m")
if len(args) > 1:
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler = (1.2, -4.2, 1.4), (1.53, 0.0, 0.27)
    scene.collection.objects.link(camera)
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.rotation_euler, sun.data.energy = (0.9, 0.3, 0.6), 3.0
    scene.collection.objects.link(sun)
    scene.camera = camera
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 8
    scene.render.resolution_x, scene.render.resolution_y = 480, 480
    scene.render.filepath = args[1]
    bpy.ops.render.render(write_still=True)
