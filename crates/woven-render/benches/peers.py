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
import os
import sys
import tempfile

import numpy as np

from sides import ours, peer, read

SPP = int(sys.argv[4]) if len(sys.argv) > 4 else 64
PEERS = sys.argv[5:] or ["mitsuba", "cycles"]
SIZE = "320x240"

print("load at the start: %.1f" % os.getloadavg()[0])
for mode in ("direct", "gi"):
    base = None
    for name in ["ours"] + PEERS:
        with tempfile.TemporaryDirectory() as folder:
            pictures, seconds = [], 0.0
            for seed in (0, 1):
                out = os.path.join(folder, "%d.exr" % seed)
                seconds += (ours(mode, seed, out, SIZE, SPP, folder) if name == "ours" else peer(name, mode, seed, out, SIZE, SPP)) / 2
                pictures.append(read(out))
        a, b = pictures
        m = (a + b) / 2
        noise = float(np.mean((a - b) ** 2 / 2 / (m * m + 0.01)))
        cost = noise * seconds
        base = base or cost
        rate = a.shape[0] * a.shape[1] * SPP / seconds / 1e6
        print("%-6s %-8s mean %.5f  relMSE %.6f  %.2f CPU-s  %.3f Ms/CPU-s  relMSE x CPU-s %.5f  (%.1f x ours)"
              % (mode, name, m.mean(), noise, seconds, rate, cost, cost / base), flush=True)
