#!/usr/bin/env python3
"""Whether this renderer and Mitsuba's volpath see the same bench scene, as far as the noise of both lets one tell.

    python3 agree.py BENCH SCENE WOVEN_RENDER [SPP] [WIDTHxHEIGHT] [direct] [gi]

Half the samples each with two seeds, so that the noise of each is known. If both converge to the same picture, relMSE of
the difference of the two means is the sum of the noises of the means: the ratio is 1, give or take a few percent.
BENCH, SCENE and WOVEN_RENDER as for peers.py.
"""
import os
import sys
import tempfile

import numpy as np

from sides import compare, ours, peer, read, write

SPP = int(sys.argv[4]) if len(sys.argv) > 4 else 4096
SIZE = sys.argv[5] if len(sys.argv) > 5 else "320x240"

for mode in sys.argv[6:] or ("direct", "gi"):
    with tempfile.TemporaryDirectory() as folder:
        means, noises = [], []
        for name in ("ours", "mitsuba"):
            pictures = []
            for seed in (11, 12):
                path = os.path.join(folder, "%s%d.exr" % (name, seed))
                if name == "ours":
                    ours(mode, seed, path, SIZE, SPP // 2, folder)
                else:
                    peer(name, mode, seed, path, SIZE, SPP // 2)
                pictures.append(read(path))
            a, b = pictures
            means.append((a + b) / 2)
            write(os.path.join(folder, name + ".exr"), means[-1])
            # Of the mean of both: half of the variance of one, which is half of the squared difference.
            noises.append((a - b) ** 2 / 4)
        a, b = means
        weight = 1 / (((a + b) / 2) ** 2 + 0.01)
        difference = float(np.mean((a - b) ** 2 * weight))
        noise = [float(np.mean(n * weight)) for n in noises]
        found = compare(os.path.join(folder, "ours.exr"), os.path.join(folder, "mitsuba.exr"))
        print("%-6s %s, %d samples: means %.5f %.5f (%+.3f %%), relMSE of the difference %.2e, noise of both %.2e + %.2e, ratio %.2f, FLIP %.4f (HDR) %.4f (LDR)"
              % (mode, SIZE, SPP, a.mean(), b.mean(), 100 * (a.mean() / b.mean() - 1), difference, noise[0], noise[1],
                 difference / sum(noise), found["flip"], found["flip_ldr"]), flush=True)
