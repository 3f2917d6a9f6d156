#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Changes between two days of generated homes, found by `plumbline compare`, against the truth.

compare_worlds.py PROGRAM FOLDER [--worlds 8] [--first 30] [--unchanged 3] [--fps 15] [--frames 450]

Each world is filmed, mapped and compared; of the last `--unchanged` worlds the second day is the same, filmed by a robot
that begins elsewhere. A change counts if it was there to be seen: its day saw 30 % of its surface, and the other day
looked through 15 %, by the depth images at their true poses. Prints a line a world and the sums.
"""
import argparse
import csv
import json
import re
import shutil
import subprocess
import zlib
from pathlib import Path

import cv2
import numpy as np


def read_ply(file):
    """Vertices of a binary PLY as a structured array."""
    kinds = {"float": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4", "uint": "<u4"}
    with open(file, "rb") as stream:
        header = b""
        while not header.endswith(b"end_header\n"):
            header += stream.readline()
        count = int(re.search(rb"element vertex (\d+)", header).group(1))
        fields = re.findall(r"property (\w+) (\S+)", header.decode().split("element face")[0])
        return np.frombuffer(stream.read(count * np.dtype([(n, kinds[k]) for k, n in fields]).itemsize),
                             [(n, kinds[k]) for k, n in fields], count)


def poses_of(file):
    """Stamps and 4 x 4 poses of a path in TUM's format."""
    rows = np.loadtxt(file, ndmin=2)
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    x, y, z, w = rows[:, 4:].T
    poses[:, 0, :3] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], 1)
    poses[:, 1, :3] = np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], 1)
    poses[:, 2, :3] = np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], 1)
    poses[:, :3, 3] = rows[:, 1:4]
    return rows[:, 0], poses


def aligned(a, b):
    """The rigid motion that lays points a onto b, in the least squares."""
    ma, mb = a.mean(0), b.mean(0)
    u, _, vt = np.linalg.svd((a - ma).T @ (b - mb))
    turn = vt.T @ np.diag([1, 1, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = turn, mb - turn @ ma
    return motion


def moved(motion, points):
    return points @ motion[:3, :3].T + motion[:3, 3]


def world_from_map(result, day):
    """By the cameras: the map's path on the true one."""
    stamps, poses = poses_of(result / "trajectory.txt")
    true_stamps, truth = poses_of(day / "groundtruth.txt")
    nearest = np.abs(true_stamps[None] - stamps[:, None]).argmin(1)
    return aligned(poses[:, :3, 3], truth[nearest][:, :3, 3])


class Day:
    """Depth images at their true poses."""

    def __init__(self, folder):
        stamps, poses = poses_of(folder / "groundtruth.txt")
        text = (folder / "camera.yaml").read_text()
        value = lambda key: float(re.search(rf"^\s*{key}: *([-\d.e]+)", text, re.M).group(1))
        self.camera = [value(k) for k in ("fx", "fy", "cx", "cy")]
        self.scale = value("depth_scale") if "depth_scale" in text else 5000.0
        self.views = []
        for line in (folder / "depth.txt").read_text().splitlines():
            if line.startswith("#"):
                continue
            stamp, name = line.split()
            depth = cv2.imread(str(folder / name), cv2.IMREAD_UNCHANGED).astype(np.float32) / self.scale
            self.views.append((np.linalg.inv(poses[np.abs(stamps - float(stamp)).argmin()]), depth))

    def evidence(self, points):
        """Of each point: number of views that see a surface there, and that look through it."""
        seen, free = np.zeros(len(points), int), np.zeros(len(points), int)
        fx, fy, cx, cy = self.camera
        for camera_from_world, depth in self.views:
            p = moved(camera_from_world, points)
            with np.errstate(all="ignore"):
                u, v = np.rint(fx * p[:, 0] / p[:, 2] + cx), np.rint(fy * p[:, 1] / p[:, 2] + cy)
            inside = (p[:, 2] > 0.3) & (p[:, 2] < 4) & (u >= 0) & (v >= 0) & (u < depth.shape[1]) & (v < depth.shape[0])
            d = np.zeros(len(points), np.float32)
            d[inside] = depth[v[inside].astype(int), u[inside].astype(int)]
            seen += (d > 0) & (np.abs(d - p[:, 2]) < 0.05)
            free += d > p[:, 2] + 0.1
        return seen, free


def inside(points, box, more):
    return np.all((points > np.array(box[0]) - more) & (points < np.array(box[1]) + more), axis=1)


def to_be_seen(box, samples, own, other):
    """Shares of what is in the box that its own day saw, and that the other day looked through where it was seen."""
    points = samples[inside(samples, box, 0.02)]
    if len(points) == 0:
        return 0.0, 0.0
    points = points[np.linspace(0, len(points) - 1, min(len(points), 400)).astype(int)]
    seen, free = own.evidence(points)[0] >= 2, other.evidence(points)[1] >= 2
    return float(np.mean(seen)), float(np.mean(seen & free))


def place_error(change, kind, row, to_world):
    """Metres: of the way of what moved, else how far the found places stick out of the true box (95 %)."""
    if kind == "moved":
        if change["kind"] == "door" or abs(change["turn_deg"]) > 1:
            return 0.0
        way = to_world[:3, :3] @ np.array([float(row[k]) for k in ("way_x", "way_y", "way_z")])
        return float(np.linalg.norm(way - change["offset_m"]))
    low, high = np.array(change["box_before_m"] or change["box_after_m"])
    out = np.maximum(low - row["points"], row["points"] - high).max(1).clip(0)
    return float(np.quantile(out, 0.95))


def judge_changes(truth, rows, samples, days, to_world):
    """(found, counted, texts) of the true changes; rows that belong to one get their "true"."""
    kinds = {"moved": "moved", "removed": "vanished", "added": "appeared", "door": "moved", "wall": "shifted"}
    found, told = 0, []
    for change in truth:
        kind = kinds.get(change["kind"])
        if kind is None:
            continue
        boxes = [change["box_before_m"], change["box_after_m"]]
        mine = [row for row in rows if sum(inside(row["points"], b, 0.08) for b in boxes if b).astype(bool).mean() > 0.7]
        for row in mine:
            row["true"] = True
        if kind == "shifted":
            continue
        shares = [to_be_seen(box, samples[k], days[k], days[1 - k]) for k, box in enumerate(boxes) if box]
        if min(s for s, _ in shares) < 0.3 or max(f for _, f in shares) < 0.15:
            continue
        place = min([place_error(change, kind, row, to_world) for row in mine if row["kind"] == kind], default=np.nan)
        found += bool(place <= 0.03)
        told.append(f"{change['thing']} {kind} {'found' if place <= 0.03 else 'MISSED'} {place:.3f} {[r['kind'] for r in mine]}")
    return found, len(told), told


def run(words, log):
    with open(log, "a") as stream:
        return subprocess.run([str(w) for w in words], stdout=stream, stderr=subprocess.STDOUT).returncode


def one_world(program, folder, number, changed, o):
    folder.mkdir(parents=True, exist_ok=True)
    log = folder / "log.txt"
    film = [program, "synth", "home", "--layout", number, "--seed", number, "--width", 320, "--height", 240, "--fps", o.fps,
            "--frames", o.frames, "--path", "tour", "--reference-spacing", 0.02, "-q"]
    if not (folder / "map_after" / "summary.json").exists():
        for day, more in (("before", []), ("after", ["--changes", 1000 + number] if changed else ["--robots", 2])):
            shutil.rmtree(folder / day, ignore_errors=True)
            run(film + more + ["-o", folder / day], log)
            robot = "robot0" if changed or day == "before" else "robot1"
            run([program, "map", folder / day / robot, "-o", folder / f"map_{day}", "--force", "-q"], log)
    robots = [folder / "before" / "robot0", folder / "after" / ("robot0" if changed else "robot1")]
    code = run([program, "compare", folder / "map_before", folder / "map_after", "-o", folder / "diff", "--order", "given", "--force"], log)
    if code != 0:
        return {"world": number, "changed": changed, "refused": True}

    summary = json.loads((folder / "diff" / "summary.json").read_text())
    cloud = read_ply(folder / "diff" / "changes.ply")
    to_world = world_from_map(folder / "map_before", robots[0])
    places = moved(to_world, np.stack([cloud[k] for k in "xyz"], 1).astype(float))
    rows = list(csv.DictReader(open(folder / "diff" / "changes.csv")))
    for row in rows:
        row["points"], row["true"] = places[cloud["change"] == int(row["number"])], False
    truth_file = folder / "after" / "changes.json"
    truth = json.loads(truth_file.read_text())["changes"] if changed else []
    touched = np.zeros(len(places), bool)
    for change in truth:
        for box in (change.get("box_before_m"), change.get("box_after_m")):
            if box:
                touched |= inside(places, box, 0.1)
    known = np.isfinite(cloud["distance"]) & ~touched
    result = {"world": number, "changed": changed, "refused": False, "listed": len(rows),
              "limit_mm": 1000 * summary["median_limit_m"], "registration_mm": 1000 * summary["registration_sigma_m"],
              "within": float(np.mean(np.abs(cloud["distance"][known]) <= cloud["limit"][known]))}
    if changed:
        days = [Day(r) for r in robots]
        samples = []
        for day in ("before", "after"):
            reference = read_ply(folder / day / "reference.ply")
            samples.append(np.stack([reference[k] for k in "xyz"], 1).astype(float)[reference["visible"] > 0])
        result["found"], result["counted"], result["told"] = judge_changes(truth, rows, samples, days, to_world)
        for change in (c for c in truth if c["kind"] == "wall"):
            box, way = change["box_before_m"], np.array(change["offset_m"])
            axis = int(np.argmax(np.abs(way)))
            normal = np.stack([cloud[k] for k in ("nx", "ny", "nz")], 1) @ to_world[:3, :3].T
            near = inside(places, box, [0.06, 0.06, 0.0]) & np.isfinite(cloud["distance"]) & (np.abs(normal[:, axis]) > 0.95)
            if near.sum() >= 100:
                ways = cloud["distance"][near] * np.sign(normal[near, axis])
                result["wall"] = [1000 * float(way[axis]), 1000 * float(np.median(ways)), 1000 * float(np.median(cloud["limit"][near]))]
    result["false"] = [f"{r['kind']} {float(r['area']):.3f} m2 {r['distance']}" for r in rows if not r["true"]]
    if not o.keep:
        for name in ("before", "after"):
            shutil.rmtree(folder / name, ignore_errors=True)
    return result


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("program", type=Path)
    p.add_argument("folder", type=Path)
    p.add_argument("--worlds", type=int, default=8)
    p.add_argument("--first", type=int, default=30, help="number of the first layout")
    p.add_argument("--unchanged", type=int, default=3)
    p.add_argument("--fps", type=int, default=15)
    p.add_argument("--frames", type=int, default=450)
    p.add_argument("--keep", action="store_true", help="keep the recordings")
    o = p.parse_args()
    results = []
    for k in range(o.worlds):
        results.append(one_world(o.program, o.folder / f"w{o.first + k}", o.first + k, k < o.worlds - o.unchanged, o))
        print(json.dumps(results[-1]), flush=True)
    done = [r for r in results if not r["refused"]]
    print(f"{len(results)} worlds, {len(results) - len(done)} refused; changes found {sum(r.get('found', 0) for r in done)} of "
          f"{sum(r.get('counted', 0) for r in done)}; false {[len(r['false']) for r in done]}; limits "
          f"{[round(r['limit_mm'], 1) for r in done]} mm hold for {[round(r['within'], 3) for r in done]}; walls (true, found, limit, mm) "
          f"{[[round(v, 1) for v in r['wall']] for r in done if 'wall' in r]}")


if __name__ == "__main__":
    main()
