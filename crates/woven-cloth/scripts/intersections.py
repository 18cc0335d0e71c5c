"""Looks for self-intersections in every frame of a curtain with ipctk, which knows nothing of this project.

    python intersections.py curtain.glb [second.glb ...]

needs `pip install ipctk numpy`. Several caches are looked at as one mesh.
"""
import json
import struct
import sys

import ipctk
import numpy as np


def load(path):
    data = open(path, "rb").read()
    size = struct.unpack_from("<I", data, 12)[0]
    head = json.loads(data[20 : 20 + size])
    blob = data[20 + size + 8 :]

    def read(n, dtype, width):
        a = head["accessors"][n]
        view = head["bufferViews"][a["bufferView"]]
        at = view.get("byteOffset", 0) + a.get("byteOffset", 0)
        return np.frombuffer(blob, dtype, a["count"] * width, at).reshape(-1, width)

    p = head["meshes"][0]["primitives"][0]
    rest = read(p["attributes"]["POSITION"], "<f4", 3)
    faces = read(p["indices"], "<u4", 1).reshape(-1, 3)
    frames = [rest] + [rest + read(t["POSITION"], "<f4", 3) for t in p["targets"]]
    return faces.astype(np.int64), [f.astype(np.float64) for f in frames]


def main():
    parts = [load(path) for path in sys.argv[1:]]
    faces, first = [], 0
    for f, frames in parts:
        faces.append(f + first)
        first += len(frames[0])
    faces = np.vstack(faces).astype(np.int32)
    edges = ipctk.edges(faces)
    count = min(len(frames) for _, frames in parts)
    mesh = ipctk.CollisionMesh(np.vstack([p[1][0] for p in parts]), edges, faces)
    bad = [
        n
        for n in range(count)
        if ipctk.has_intersections(mesh, np.vstack([p[1][n] for p in parts]))
    ]
    print(f"{sys.argv[1:]}: {count} poses (0 is the rest), intersections in {len(bad)}: {bad[:20]}")


main()
