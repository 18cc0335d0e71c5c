#!/usr/bin/env python3
"""The bench scene by this renderer and by its peers, one after the other in one run: relMSE x CPU-seconds.

    python3 peers.py BENCH SCENE WOVEN_RENDER [SPP] [mitsuba] [cycles]

BENCH holds render_mitsuba.py and render_cycles.py, SCENE what curtain_scene.py wrote, WOVEN_RENDER is the release
binary. Needs the Python packages mitsuba (it also reads the EXR files) and, for Cycles, bpy.

Two seeds each; relMSE = mean((x - y)^2 / 2 / (m^2 + 0.01)), m their mean, at 320 x 240. The peers' seconds leave out
loading; ours hold everything, the building of the ray structure too. Depth: ours counts scatterings, theirs edges.
"""
import json
import os
import resource
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


def children():
    r = resource.getrusage(resource.RUSAGE_CHILDREN)
    return r.ru_utime + r.ru_stime


def ours(mode, seed, out):
    before = children()
    command = [OURS, "frame", os.path.join(SCENE, "scene.glb"), "-o", out, "--size", "%dx%d" % SIZE, "--spp", str(SPP),
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
                seconds += (ours(mode, seed, out) if name == "ours" else peer(name, mode, seed, out)) / 2
                pictures.append(read(out))
        a, b = pictures
        m = (a + b) / 2
        noise = float(np.mean((a - b) ** 2 / 2 / (m * m + 0.01)))
        cost = noise * seconds
        base = base or cost
        rate = SIZE[0] * SIZE[1] * SPP / seconds / 1e6
        print("%-6s %-8s mean %.5f  relMSE %.6f  %.2f CPU-s  %.3f Ms/CPU-s  relMSE x CPU-s %.5f  (%.1f x ours)"
              % (mode, name, m.mean(), noise, seconds, rate, cost, cost / base), flush=True)
