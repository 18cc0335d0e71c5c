#!/usr/bin/env python3
"""Whether this renderer and Mitsuba's volpath see the same bench scene, as far as the noise of both lets one tell.

    python3 agree.py BENCH SCENE WOVEN_RENDER [SPP] [WIDTHxHEIGHT] [direct] [gi]

Half the samples each with two seeds, so that the noise of each is known. If both converge to the same picture, relMSE of
the difference of the two means is the sum of the noises of the means: the ratio is 1, give or take a few percent.
BENCH, SCENE and WOVEN_RENDER as for peers.py.
"""
import os
import subprocess
import sys
import tempfile

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
BENCH, SCENE, OURS = sys.argv[1:4]
SPP = int(sys.argv[4]) if len(sys.argv) > 4 else 4096
SIZE = sys.argv[5] if len(sys.argv) > 5 else "320x240"
WIDTH, HEIGHT = SIZE.split("x")


def read(path):
    return np.array(mi.Bitmap(path).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32), dtype=np.float64)


def write(path, picture):
    mi.Bitmap(picture.astype(np.float32)).write(path)


def ours(mode, seed, out):
    command = [OURS, "frame", os.path.join(SCENE, "scene.glb"), "-o", out, "--size", SIZE, "--spp", str(SPP // 2), "--seed",
               str(seed), "--backend", "cpu", "--depth", "7"]
    subprocess.run(command + (["--integrator", "direct"] if mode == "direct" else []), check=True, capture_output=True)


def mitsuba(mode, seed, out):
    command = [sys.executable, os.path.join(BENCH, "render_mitsuba.py"), "--scene", SCENE, "--out", out, "--width", WIDTH,
               "--height", HEIGHT, "--spp", str(SPP // 2), "--mode", mode, "--seed", str(seed)]
    subprocess.run(command, check=True, capture_output=True)


for mode in sys.argv[6:] or ("direct", "gi"):
    with tempfile.TemporaryDirectory() as folder:
        means, noises = [], []
        for name, run in (("ours", ours), ("mitsuba", mitsuba)):
            pictures = []
            for seed in (11, 12):
                path = os.path.join(folder, "%s%d.exr" % (name, seed))
                run(mode, seed, path)
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
        flip = subprocess.run([OURS, "compare", os.path.join(folder, "ours.exr"), os.path.join(folder, "mitsuba.exr")],
                              check=True, capture_output=True, text=True).stdout.strip().replace("\n", "; ")
        print("%-6s %s, %d samples: means %.5f %.5f (%+.3f %%), relMSE of the difference %.2e, noise of both %.2e + %.2e, ratio %.2f; %s"
              % (mode, SIZE, SPP, a.mean(), b.mean(), 100 * (a.mean() / b.mean() - 1), difference, noise[0], noise[1],
                 difference / sum(noise), flip), flush=True)
