#!/usr/bin/env python3
"""Prints the expected numbers of files_flip.rs (PyPI flip-evaluator 1.7, numpy 2.4).

The two pictures are made from integers by the same formula on both sides.
"""
import numpy as np
import flip_evaluator

W, H = 64, 48
y, x, c = np.meshgrid(np.arange(H), np.arange(W), np.arange(3), indexing="ij")


def pattern(k):
    """0..1: slow stripes, a bright block and small grain that depends on k."""
    stripes = ((x * (3 + c) + y * 5) // 9) % 7 / 7.0
    block = np.where((x // 11 + y // 13) % 3 == 0, 1.0, 0.4)
    grain = ((x * 7919 + y * 104729 + c * 1299709 + k * 15485863) % 101) / 101.0
    return stripes * block * 0.8 + grain * 0.2 * (k + 1) / 2.0


ref, test = pattern(0), pattern(1)
test[20:28, 30:44, 0] *= 0.5
for name, scale in (("LDR", 1.0), ("HDR", 1.0)):
    r, t = ref, test
    if name == "HDR":
        r, t = 12.0 * ref ** 3, 12.0 * test ** 3
    m, mean, p = flip_evaluator.evaluate(r.astype(np.float32), t.astype(np.float32), name, inputsRGB=False, applyMagma=False)
    print(name, "mean", repr(float(mean)), {k: p[k] for k in ("startExposure", "stopExposure", "numExposures")})
    for yy, xx in ((0, 0), (24, 36), (47, 63), (10, 20)):
        print("  (%d, %d): %.6f" % (xx, yy, float(np.asarray(m)[yy, xx].ravel()[0])))
