#!/usr/bin/env python3
"""The bench scene by this renderer and by its peers, one after the other in one run: relMSE x CPU-seconds.

    python3 peers.py BENCH SCENE WOVEN_RENDER [SPP] [mitsuba] [cycles]

BENCH holds render_mitsuba.py and render_cycles.py, SCENE what curtain_scene.py wrote, WOVEN_RENDER is the release
binary. Needs the Python packages mitsuba (it also reads the EXR files) and, for Cycles, bpy.

Two seeds each; relMSE = mean((x - y)^2 / 2 / (m^2 + 0.01)), m their mean, at 320 x 240. The peers' seconds leave out
loading; ours hold everything, the building of the ray structure too. Depth: ours counts scatterings, theirs edges.
Our copy of the scene says where its window is (a mesh that is only marked, not seen); the peers take no such hint for
a panel.
"""
import json
import os
import resource
import struct
import subprocess
import sys
import tempfile

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
BENCH, SCENE, OURS = sys.argv[1:4]
SPP = int(sys.argv[4]) if len(sys.argv) > 4 else 64
PEERS = sys.argv[5:] or ["mitsuba", "cycles"]
SIZE = (320, 240)


def read(path):
    return np.array(mi.Bitmap(path).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32), dtype=np.float64)


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


def ours(mode, seed, out, scene):
    before = children()
    command = [OURS, "frame", scene, "-o", out, "--size", "%dx%d" % SIZE, "--spp", str(SPP),
               "--seed", str(seed), "--backend", "cpu", "--depth", "7"]
    subprocess.run(command + (["--integrator", "direct"] if mode == "direct" else []), check=True, capture_output=True)
    return children() - before


def peer(name, mode, seed, out):
    command = [sys.executable, os.path.join(BENCH, "render_%s.py" % name), "--scene", SCENE, "--out", out, "--width",
               str(SIZE[0]), "--height", str(SIZE[1]), "--spp", str(SPP), "--mode", mode, "--seed", str(seed)]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    line = next(l for l in text.splitlines() if l.startswith("RESULT "))
    return json.loads(line[7:])["render"][1]


print("load at the start: %.1f" % os.getloadavg()[0])
for mode in ("direct", "gi"):
    base = None
    for name in ["ours"] + PEERS:
        with tempfile.TemporaryDirectory() as folder:
            pictures, seconds = [], 0.0
            for seed in (0, 1):
                out = os.path.join(folder, "%d.exr" % seed)
                seconds += (ours(mode, seed, out, with_window(folder)) if name == "ours" else peer(name, mode, seed, out)) / 2
                pictures.append(read(out))
        a, b = pictures
        m = (a + b) / 2
        noise = float(np.mean((a - b) ** 2 / 2 / (m * m + 0.01)))
        cost = noise * seconds
        base = base or cost
        rate = SIZE[0] * SIZE[1] * SPP / seconds / 1e6
        print("%-6s %-8s mean %.5f  relMSE %.6f  %.2f CPU-s  %.3f Ms/CPU-s  relMSE x CPU-s %.5f  (%.1f x ours)"
              % (mode, name, m.mean(), noise, seconds, rate, cost, cost / base), flush=True)
