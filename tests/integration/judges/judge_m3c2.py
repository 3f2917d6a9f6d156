# SPDX-License-Identifier: BSD-3-Clause
"""judge_m3c2.py PROGRAM FOLDER: distances and limits of `plumbline compare` against M3C2 written anew (Lague et al. 2013,
equation 1), at the same core points, normals and scales. Two scans of a room with noise, of which a wall shifts by 12 mm.
"""
import re
import subprocess
import sys
from pathlib import Path

try:
    import numpy as np
    from scipy.spatial import cKDTree
except ImportError as missing:
    print(f"not installed: {missing}")
    sys.exit(77)
import json

RADIUS_M, DEPTH_M, FEWEST = 0.05, 0.08, 4  # the program's defaults


def read_ply(file):
    """Vertices of a binary PLY as a dictionary of columns."""
    kinds = {"float": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4"}
    header, _, data = file.read_bytes().partition(b"end_header\n")
    fields = [(name, kinds[kind]) for kind, name in re.findall(r"property (\w+) (\S+)", header.decode())]
    count = int(re.search(rb"vertex (\d+)", header).group(1))
    return np.frombuffer(data, fields, count)


def write_ply(file, points, normals):
    header = f"ply\nformat binary_little_endian 1.0\ncomment frame: z up\nelement vertex {len(points)}\n"
    header += "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz")) + "end_header\n"
    file.write_bytes(header.encode() + np.hstack([points, normals]).astype("<f4").tobytes())


def room(random, shift):
    """Floor, four walls, the lowest of which shifts, and a box, each centimetre about, with noise that grows along x."""
    faces = [([0, 0, 0], [4, 0, 0], [0, 3, 0]), ([4, 3 - shift, 0], [-4, 0, 0], [0, 0, 1.2]), ([0, 3, 0], [0, -3, 0], [0, 0, 2]),
             ([0, 0, 0], [4, 0, 0], [0, 0, 2]),
             ([4, 0, 0], [0, 3, 0], [0, 0, 2]), ([1, 1, 0], [0.8, 0, 0], [0, 0, 0.6]), ([1, 1, 0.6], [0.8, 0, 0], [0, 0.5, 0])]
    points, normals = [], []
    for corner, u, v in np.array(faces, float):
        count = int(np.linalg.norm(u) * np.linalg.norm(v) * 6000)
        a, b = random.random((2, count, 1))
        normal = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
        at = corner + a * u + b * v
        points.append(at + random.normal(0, 1, (count, 1)) * (0.001 + 0.001 * at[:, :1]) * normal)
        normals.append(np.tile(normal, (count, 1)))
    return np.vstack(points), np.vstack(normals)


def cylinders(points, normals, cores, axes):
    """Count, mean and standard deviation along the axis of the points of each core's cylinder."""
    tree = cKDTree(points)
    out = np.full((len(cores), 3), np.nan)
    for i, near in enumerate(tree.query_ball_point(cores, np.hypot(RADIUS_M, DEPTH_M))):
        way = points[near] - cores[i]
        along = way @ axes[i]
        across = np.linalg.norm(way - along[:, None] * axes[i], axis=1)
        along = along[(np.abs(along) <= DEPTH_M) & (across <= RADIUS_M) & (normals[near] @ axes[i] >= 0.5)]
        out[i, 0] = len(along)
        if len(along) >= FEWEST:
            out[i, 1:] = along.mean(), along.std(ddof=1)
    return out


def main(program, folder):
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(1)
    clouds = [room(random, shift) for shift in (0.0, 0.012)]
    for name, cloud in zip("ab", clouds):
        write_ply(folder / f"{name}.ply", *cloud)
    subprocess.run([program, "compare", folder / "a.ply", folder / "b.ply", "-o", folder / "diff", "--force", "-q"], check=True)

    summary = json.loads((folder / "diff" / "summary.json").read_text())
    places = read_ply(folder / "diff" / "changes.ply")
    places = places[places["later"] == 0]
    cores, axes = (np.stack([places[k] for k in keys], 1).astype(float) for keys in (("x", "y", "z"), ("nx", "ny", "nz")))
    motion = np.array(summary["before_from_after"])
    before = cylinders(*(c.astype(np.float32).astype(float) for c in clouds[0]), cores, axes)
    after = cylinders(clouds[1][0] @ motion[:3, :3].T + motion[:3, 3], clouds[1][1] @ motion[:3, :3].T, cores, axes)

    distance = after[:, 1] - before[:, 1]
    limit = 1.96 * (np.sqrt(before[:, 2] ** 2 / before[:, 0] + after[:, 2] ** 2 / after[:, 0]) + summary["registration_sigma_m"])
    known = np.isfinite(distance) & np.isfinite(places["distance"])
    off = [1000 * float(np.quantile(np.abs(a[known] - places[k][known]), 0.99)) for a, k in ((distance, "distance"), (limit, "limit"))]
    wall = known & (axes[:, 1] > 0.9) & (cores[:, 1] > 2.9)
    way = 1000 * float(np.median(places["distance"][wall]))
    print(f"{known.sum()} places; 99 % of distances within {off[0]:.4f} mm, of limits within {off[1]:.4f} mm; the wall {way:+.2f} mm")
    wrong = max(off) > 0.1 or known.sum() < 5000 or np.mean(np.isfinite(distance) != np.isfinite(places["distance"])) > 0.001
    return int(wrong or abs(way + 12.0) > 3.0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], Path(sys.argv[2])))
