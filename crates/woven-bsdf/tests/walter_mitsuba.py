"""Values of Walter's transmission lobe from an independent implementation, for tests/proofs/published.rs.

    python3 -m venv venv && venv/bin/pip install mitsuba && venv/bin/python walter_mitsuba.py > proofs/walter_mitsuba.csv

Mitsuba 3's `roughdielectric` (GGX, Smith), variant scalar_rgb, in importance mode: no radiance compression, so that its
value is f |cos theta_v| with the light in air and the viewer in the dense medium. Its arithmetic is single precision.
"""

import math
import random

import mitsuba as mi

mi.set_variant("scalar_rgb")
random.seed(7)
print(f"# mitsuba {mi.__version__}, tests/walter_mitsuba.py")
print("alpha,n,theta_l_deg,phi_l_deg,theta_v_deg,phi_v_deg,f")
for alpha in (0.1, 0.3, 0.6):
    for n in (1.3, 1.5, 1.8):
        bsdf = mi.load_dict(
            {"type": "roughdielectric", "distribution": "ggx", "alpha": alpha, "int_ior": n, "ext_ior": 1.0}
        )
        found = 0
        while found < 4:
            tl, pl = random.uniform(0, 75), random.uniform(-180, 180)
            # Around the refracted direction, where the lobe is.
            tr = math.degrees(math.asin(math.sin(math.radians(tl)) / n))
            tv, pv = 180 - abs(tr + random.uniform(-20, 20)), pl + 180 + random.uniform(-20, 20)
            a, b, c, d = (math.radians(x) for x in (tl, pl, tv, pv))
            si = mi.SurfaceInteraction3f()
            si.wi = mi.Vector3f(math.sin(a) * math.cos(b), math.sin(a) * math.sin(b), math.cos(a))
            wo = mi.Vector3f(math.sin(c) * math.cos(d), math.sin(c) * math.sin(d), math.cos(c))
            ctx = mi.BSDFContext(mi.TransportMode.Importance)
            value = bsdf.eval(ctx, si, wo)[0] / abs(math.cos(c))
            if value > 1e-3:
                found += 1
                print(f"{alpha},{n},{tl!r},{pl!r},{tv!r},{pv!r},{value!r}")
