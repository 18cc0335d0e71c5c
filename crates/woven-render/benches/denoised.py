#!/usr/bin/env python3
"""Both renderers with their denoisers on: CPU-seconds and FLIP against a converged picture of the bench scene.

    python3 denoised.py BENCH SCENE WOVEN_RENDER [CONVERGED]

Ours filters with its own denoiser, Cycles with OpenImageDenoise led by albedo and normal (as the bench's script asks for). The
converged picture is ours, without a filter: CONVERGED samples (512), or a file of an earlier run. agree.py shows that Mitsuba converges to the same. CPU-seconds as in peers.py.
"""
import os
import sys
import tempfile

from sides import compare, ours, peer

CONVERGED = sys.argv[4] if len(sys.argv) > 4 else "512"
SIZE = "320x240"

with tempfile.TemporaryDirectory() as folder:
    reference = CONVERGED
    if CONVERGED.isdigit():
        reference = os.path.join(folder, "reference.exr")
        ours("gi", 99, reference, SIZE, int(CONVERGED), folder)
    for name, counts in (("ours", (1, 2, 4, 8, 16, 32)), ("cycles", (4, 8, 16, 32, 64, 128))):
        for spp in counts:
            out = os.path.join(folder, "%s%d.exr" % (name, spp))
            if name == "ours":
                seconds = ours("gi", 0, out, SIZE, spp, folder, "--denoise")
            else:
                seconds = peer(name, "gi", 0, out, SIZE, spp, "--denoise")
            found = compare(out, reference)
            print("%-7s %4d samples  %6.2f CPU-s  FLIP %.4f (HDR) %.4f (LDR)  relMSE %.6f"
                  % (name, spp, seconds, found["flip"], found["flip_ldr"], found["rel_mse"]), flush=True)
