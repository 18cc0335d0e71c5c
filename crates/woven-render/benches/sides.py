"""Both sides of a comparison on the bench scene: this renderer, and its peers by the bench's own scripts.

The first three words of the command line are BENCH, SCENE and WOVEN_RENDER; see peers.py.
"""
import json
import os
import resource
import struct
import subprocess
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
BENCH, SCENE, OURS = sys.argv[1:4]


def read(path):
    return np.array(mi.Bitmap(path).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32), dtype=np.float64)


def write(path, picture):
    mi.Bitmap(picture.astype(np.float32)).write(path)


def with_window(folder):
    """A copy of the scene whose window, from scene.json, is marked as one."""
    with open(os.path.join(SCENE, "scene.glb"), "rb") as f:
        glb = f.read()
    length = struct.unpack("<I", glb[12:16])[0]
    scene, data = json.loads(glb[20:20 + length]), glb[28 + length:]
    with open(os.path.join(SCENE, "scene.json")) as f:
        window = json.load(f)["window"]
    (x0, x1), (y0, y1) = window["x"], window["y"]
    corners = [(x0, y0, 0), (x1, y0, 0), (x1, y1, 0), (x0, y1, 0)]
    added = b"".join(struct.pack("<3f", *c) for c in corners) + struct.pack("<6H", 0, 1, 2, 0, 2, 3)
    view, accessor = len(scene["bufferViews"]), len(scene["accessors"])
    scene["bufferViews"] += [{"buffer": 0, "byteOffset": len(data), "byteLength": 48},
                             {"buffer": 0, "byteOffset": len(data) + 48, "byteLength": 12}]
    scene["accessors"] += [{"bufferView": view, "componentType": 5126, "count": 4, "type": "VEC3",
                            "min": list(corners[0]), "max": list(corners[2])},
                           {"bufferView": view + 1, "componentType": 5123, "count": 6, "type": "SCALAR"}]
    scene["meshes"].append({"primitives": [{"attributes": {"POSITION": accessor}, "indices": accessor + 1}]})
    scene["nodes"].append({"mesh": len(scene["meshes"]) - 1, "extras": {"woven": "portal"}})
    scene["scenes"][0]["nodes"].append(len(scene["nodes"]) - 1)
    data += added
    scene["buffers"][0]["byteLength"] = len(data)
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    out = os.path.join(folder, "window.glb")
    with open(out, "wb") as f:
        f.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(data)))
        f.write(struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data)
    return out


def children():
    r = resource.getrusage(resource.RUSAGE_CHILDREN)
    return r.ru_utime + r.ru_stime


def ours(mode, seed, out, size, spp, folder, *more):
    """Renders with the window marked and returns the CPU-seconds."""
    before = children()
    command = [OURS, "frame", with_window(folder), "-o", out, "--size", size, "--spp", str(spp), "--seed", str(seed),
               "--backend", "cpu", "--depth", "7", *more]
    subprocess.run(command + (["--integrator", "direct"] if mode == "direct" else []), check=True, capture_output=True)
    return children() - before


def peer(name, mode, seed, out, size, spp, *more):
    width, height = size.split("x")
    command = [sys.executable, os.path.join(BENCH, "render_%s.py" % name), "--scene", SCENE, "--out", out, "--width", width,
               "--height", height, "--spp", str(spp), "--mode", mode, "--seed", str(seed), *more]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    line = next(l for l in text.splitlines() if l.startswith("RESULT "))
    return json.loads(line[7:])["render"][1]


def compare(a, b):
    """Every figure of `woven-render compare`."""
    done = subprocess.run([OURS, "compare", a, b, "--json"], check=True, capture_output=True, text=True)
    return json.loads(done.stdout)
