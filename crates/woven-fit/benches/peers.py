"""The NIST problems by woven-fit and by scipy, side by side in one run.

    pip install scipy
    python3 crates/woven-fit/benches/peers.py          from the project's root

Both get exact derivatives and the same starts; scipy runs `least_squares` with method lm and trf at tolerances of 1e-15
(its best settings for these problems). Times are of the processor, the least of five, so that other work on the machine does not
count; ratios are what to look at.
"""

import math, subprocess, sys, time
from pathlib import Path
import numpy as np
from scipy.optimize import least_squares

HERE = Path(__file__).resolve().parent
exp, log, cos, sin, sqrt, arctan, pi = np.exp, np.log, np.cos, np.sin, np.sqrt, np.arctan, np.pi


def cubic(b, x):
    p, q = b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3, 1 + b[4] * x + b[5] * x**2 + b[6] * x**3
    return p / q, [1 / q, x / q, x**2 / q, x**3 / q, -p * x / q**2, -p * x**2 / q**2, -p * x**3 / q**2]


def kirby(b, x):
    p, q = b[0] + b[1] * x + b[2] * x**2, 1 + b[3] * x + b[4] * x**2
    return p / q, [1 / q, x / q, x**2 / q, -p * x / q**2, -p * x**2 / q**2]


def decay(b, x):
    e = exp(-b[1] * x)
    return b[0] * (1 - e), [1 - e, b[0] * x * e]


def chwirut(b, x):
    e, q = exp(-b[0] * x), b[1] + b[2] * x
    return e / q, [-x * e / q, -e / q**2, -x * e / q**2]


def enso(b, x):
    t = 2 * pi * x
    f = b[0] + b[1] * cos(t / 12) + b[2] * sin(t / 12) + b[4] * cos(t / b[3]) + b[5] * sin(t / b[3]) + b[7] * cos(t / b[6]) + b[8] * sin(t / b[6])
    d4 = (b[4] * sin(t / b[3]) - b[5] * cos(t / b[3])) * t / b[3] ** 2
    d7 = (b[7] * sin(t / b[6]) - b[8] * cos(t / b[6])) * t / b[6] ** 2
    return f, [1 + 0 * x, cos(t / 12), sin(t / 12), d4, cos(t / b[3]), sin(t / b[3]), d7, cos(t / b[6]), sin(t / b[6])]


def eckerle(b, x):
    u = (x - b[2]) / b[1]
    e = exp(-0.5 * u**2)
    return b[0] / b[1] * e, [e / b[1], b[0] / b[1] ** 2 * e * (u**2 - 1), b[0] / b[1] ** 2 * e * u]


def gauss(b, x):
    e, u, v = exp(-b[1] * x), (x - b[3]) / b[4], (x - b[6]) / b[7]
    g, h = exp(-(u**2)), exp(-(v**2))
    f = b[0] * e + b[2] * g + b[5] * h
    return f, [e, -b[0] * x * e, g, 2 * b[2] * g * u / b[4], 2 * b[2] * g * u**2 / b[4], h, 2 * b[5] * h * v / b[7], 2 * b[5] * h * v**2 / b[7]]


def lanczos(b, x):
    e = [exp(-b[i] * x) for i in (1, 3, 5)]
    return b[0] * e[0] + b[2] * e[1] + b[4] * e[2], [e[0], -b[0] * x * e[0], e[1], -b[2] * x * e[1], e[2], -b[4] * x * e[2]]


def mgh09(b, x):
    p, q = x**2 + x * b[1], x**2 + x * b[2] + b[3]
    return b[0] * p / q, [p / q, b[0] * x / q, -b[0] * p * x / q**2, -b[0] * p / q**2]


def mgh10(b, x):
    e = exp(b[1] / (x + b[2]))
    return b[0] * e, [e, b[0] * e / (x + b[2]), -b[0] * e * b[1] / (x + b[2]) ** 2]


def mgh17(b, x):
    e, g = exp(-x * b[3]), exp(-x * b[4])
    return b[0] + b[1] * e + b[2] * g, [1 + 0 * x, e, g, -b[1] * x * e, -b[2] * x * g]


def misra1b(b, x):
    q = 1 + b[1] * x / 2
    return b[0] * (1 - q**-2), [1 - q**-2, b[0] * x * q**-3]


def misra1c(b, x):
    q = 1 + 2 * b[1] * x
    return b[0] * (1 - q**-0.5), [1 - q**-0.5, b[0] * x * q**-1.5]


def misra1d(b, x):
    q = 1 + b[1] * x
    return b[0] * b[1] * x / q, [b[1] * x / q, b[0] * x / q**2]


def nelson(b, x, x2):
    e = exp(-b[2] * x2)
    return b[0] - b[1] * x * e, [1 + 0 * x, -x * e, b[1] * x * x2 * e]


def rat42(b, x):
    e = exp(b[1] - b[2] * x)
    return b[0] / (1 + e), [1 / (1 + e), -b[0] * e / (1 + e) ** 2, b[0] * x * e / (1 + e) ** 2]


def rat43(b, x):
    e = exp(b[1] - b[2] * x)
    f = b[0] * (1 + e) ** (-1 / b[3])
    return f, [f / b[0], -f * e / (b[3] * (1 + e)), f * x * e / (b[3] * (1 + e)), f * log(1 + e) / b[3] ** 2]


def roszman(b, x):
    u = b[2] / (x - b[3])
    d = 1 / (pi * (1 + u**2))
    return b[0] - b[1] * x - arctan(u) / pi, [1 + 0 * x, -x, -d / (x - b[3]), -d * b[2] / (x - b[3]) ** 2]


def bennett(b, x):
    f = b[0] * (b[1] + x) ** (-1 / b[2])
    return f, [f / b[0], -f / (b[2] * (b[1] + x)), f * log(b[1] + x) / b[2] ** 2]


def danwood(b, x):
    return b[0] * x ** b[1], [x ** b[1], b[0] * x ** b[1] * log(x)]


MODELS = dict(
    Bennett5=bennett, BoxBOD=decay, Misra1a=decay, Chwirut1=chwirut, Chwirut2=chwirut, DanWood=danwood, ENSO=enso, Eckerle4=eckerle,
    Gauss1=gauss, Gauss2=gauss, Gauss3=gauss, Hahn1=cubic, Thurber=cubic, Kirby2=kirby, Lanczos1=lanczos, Lanczos2=lanczos,
    Lanczos3=lanczos, MGH09=mgh09, MGH10=mgh10, MGH17=mgh17, Misra1b=misra1b, Misra1c=misra1c, Misra1d=misra1d, Nelson=nelson,
    Rat42=rat42, Rat43=rat43, Roszman1=roszman,
)


def read(name):
    starts, certified, data = ([], []), [], []
    for i, line in enumerate((HERE / "../tests/nist" / f"{name}.dat").read_text().splitlines()):
        words = line.split()
        if i < 60 and len(words) == 6 and words[0][0] == "b" and words[1] == "=":
            starts[0].append(float(words[2])), starts[1].append(float(words[3])), certified.append(float(words[4]))
        elif i >= 60 and words:
            data.append([float(w) for w in words])
    data = np.array(data).T
    return starts, np.array(certified), log(data[0]) if name == "Nelson" else data[0], data[1:]


def digits(found, certified):
    with np.errstate(all="ignore"):
        lre = -np.log10(np.abs(found - certified) / np.abs(certified))
    return float(np.clip(np.where(np.isnan(lre), 0, lre), 0, 11).min())


def main():
    command = ["cargo", "bench", "-q", "-p", "woven-fit", "--bench", "nist", "--", "--csv"]
    lines = subprocess.run(command, cwd=HERE / "../../..", capture_output=True, text=True, check=True).stdout.splitlines()
    ours = {(w[0], int(w[1])): (float(w[2]), float(w[6])) for w in (l.split(",") for l in lines[1:])}
    print(f"{'problem':9} start   woven-fit        scipy lm         scipy trf   (digits, µs)")
    totals = {"woven-fit": [0, 0, 0.0], "lm": [0, 0, 0.0], "trf": [0, 0, 0.0]}
    np.seterr(all="ignore")
    for name in sorted(MODELS):
        starts, certified, y, x = read(name)
        fun = lambda b: MODELS[name](b, *x)[0] - y
        jac = lambda b: np.array(MODELS[name](b, *x)[1]).T
        for s in (0, 1):
            row = {"woven-fit": ours[name, s + 1]}
            for method in ("lm", "trf"):
                best, found = math.inf, np.full(len(certified), np.nan)
                for _ in range(5):
                    clock = time.process_time()
                    try:
                        scale = {"x_scale": "jac"}
                        tol = dict(xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=20000)
                        found = least_squares(fun, starts[s], jac, method=method, **tol, **scale).x
                    except Exception:
                        pass
                    best = min(best, time.process_time() - clock)
                row[method] = (digits(found, certified), best * 1e6)
            print(f"{name:9} {s + 1:5}" + "".join(f"   {d:5.1f} {t:8.0f}" for d, t in row.values()))
            for k, (d, t) in row.items():
                totals[k][0] += d >= 6
                totals[k][1] += d
                totals[k][2] += t
    for k, (six, total, micros) in totals.items():
        print(f"{k:10} {six} of 54 with six digits or more, mean {total / 54:.2f}, {micros / 1e3:.1f} ms, {micros / totals['woven-fit'][2]:.1f} times woven-fit's time")


if __name__ == "__main__":
    sys.exit(main())
