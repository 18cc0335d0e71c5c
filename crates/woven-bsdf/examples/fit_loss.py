"""Chooses the coefficients of `LOSS_XY` in `src/term/albedo.rs` by a linear program.

    cargo run --release -p woven-bsdf --example loss_reference > loss.csv
    python3 fit_loss.py loss.csv          needs numpy and scipy (1.17 was used)

The closed form may exceed the reference nowhere by more than SLACK (the sheet must not give more light than it gets); the
greatest deficit, weighed by how extreme the widths and the direction are, is made as small as possible.
"""

import sys

import numpy as np
from scipy.optimize import linprog

SLACK = 5e-4
BOUND = float(sys.argv[2]) if len(sys.argv) > 2 else 20.0
I, J = (int(sys.argv[3]), int(sys.argv[4])) if len(sys.argv) > 4 else (5, 3)
ax, ay, z, phi, loss = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1).T

r2 = 1 - z * z
q = (ax**2 * np.cos(phi) ** 2 + ay**2 * np.sin(phi) ** 2) * r2
mean = (ax**2 + ay**2) * r2
n = lambda k: np.sqrt(k * q + z * z)
y = z / n(2)
basis = [np.ones_like(z), y**4, 2 * z / (z + n(1)) * np.sqrt(mean + z * z), q, n(0.25) * y, n(1)]
a, e = np.sqrt((ax**2 + ay**2) / 2), ((ax - ay) / (ax + ay)) ** 2
A = np.stack([b * a ** (i / 2) * e**j for b in basis for j in range(J) for i in range(I)], 1)

ratio = np.maximum(ax, ay) / np.minimum(ax, ay)
weight = np.where(ratio < 4.8, 1.0, np.where(ratio < 12, 1.8, 4.0))
weight *= np.where(z > 0.15, 1.0, np.where(z > 0.05, 1.5, 2.0))
rows = np.block([[A, np.zeros((len(loss), 1))], [-A, -weight[:, None]]])
limits = np.concatenate([loss + SLACK, -loss])
m = A.shape[1]
best = linprog(np.r_[np.zeros(m), 1], A_ub=rows, b_ub=limits, bounds=[(-BOUND, BOUND)] * m + [(0, None)], method="highs")
c = best.x[:m]
print("deficit", best.x[-1], file=sys.stderr)
error = np.maximum(A @ c, 0) - loss
for name, where in (("below 81 degrees", z > 0.15), ("all", z > 0)):
    for lo, hi in ((0, 1.1), (1.1, 4.8), (4.8, 12), (12, 60)):
        part = error[where & (ratio >= lo) & (ratio < hi)]
        print(f"{name}, ratio {lo}..{hi}: {part.min():+.4f} {part.max():+.4f}", file=sys.stderr)
for table in c.reshape(6, J, I):
    print("    [")
    for row in table:
        print("        [" + ", ".join(f"{x:.6f}" for x in row) + "],")
    print("    ],")
