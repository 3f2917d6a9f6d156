# SPDX-License-Identifier: BSD-3-Clause
"""judge_grid.py GRID.yaml SCENE.yaml SCENE.json TRAJECTORY.txt: an occupancy grid against the scene file.

A cell is truly free if nothing stands over its middle at the grid's heights. Prints the share of cells inside furniture
that are free, and the share of cells with room around them that are; fails if the first is above 2 % or the second
below 45 %.
"""
import math
import re
import sys

import numpy as np
import yaml
from judge_plan import scene_from_map, turned

SIZES = {"desk": (1.5, 0.75, 0.74), "table": (1.2, 0.7, 0.72), "shelf": (0.9, 0.32, 1.9), "sofa": (1.9, 0.9, 0.85),
         "cabinet": (0.9, 0.45, 0.8), "chair": (0.48, 0.46, 1.0)}
LOW_M, HIGH_M = 0.1, 1.8
ROOM_M = 0.15  # around a cell that is free beyond doubt
MOST_INSIDE, LEAST_OUTSIDE = 0.02, 0.45


def read_grid(file):
    """Cells as 0 (occupied), 205 or 254, by row from below, then column; the corner; the resolution."""
    keys = yaml.safe_load(open(file))
    data = open(file.replace(".yaml", ".pgm"), "rb").read()
    head = re.match(rb"P5\n(?:#[^\n]*\n)*(\d+) (\d+)\n255\n", data)
    width, height = int(head.group(1)), int(head.group(2))
    cells = np.frombuffer(data[head.end():], np.uint8).reshape(height, width)[::-1]
    return cells, np.array(keys["origin"][:2]), keys["resolution"]


def inside(points, middle, size, yaw, margin):
    """True where points lie in a box seen from above, or within a margin of it."""
    c, s = math.cos(yaw), math.sin(yaw)
    own = (points - middle) @ np.array([[c, -s], [s, c]])
    return (np.abs(own) <= np.array(size) / 2 + margin).all(axis=1)


def degrees(value):
    return math.radians(float(str(value).split()[0]))


def main():
    grid_file, scene_file, start_file, path_file = sys.argv[1:5]
    cells, corner, resolution = read_grid(grid_file)
    yaw, shift = scene_from_map(start_file, path_file)
    rows, columns = np.indices(cells.shape)
    middles = corner + resolution * (np.stack([columns.ravel(), rows.ravel()], axis=1) + 0.5)
    points = turned(middles, yaw, shift)
    state = cells.ravel()

    furniture = np.zeros(len(points), bool)
    near = np.zeros(len(points), bool)
    floor = np.zeros(len(points), bool)
    by_kind = {}
    for thing in yaml.safe_load(open(scene_file))["objects"]:
        kind, keys = next(iter(thing.items()))
        if kind == "floor":
            low, high = np.minimum(keys["from"], keys["to"]), np.maximum(keys["from"], keys["to"])
            floor |= ((points > low) & (points < high)).all(axis=1)
        elif kind == "wall":
            a, b = np.array(keys["from"], float), np.array(keys["to"], float)
            along = math.atan2(*(b - a)[::-1])
            length = np.linalg.norm(b - a)
            near |= inside(points, (a + b) / 2, (length, keys.get("thickness", 0.12)), along, ROOM_M)
        elif kind in SIZES or kind == "box":
            size = keys.get("size", SIZES.get(kind))
            foot = keys["at"][2] if len(keys["at"]) > 2 else 0.0
            if foot + size[2] <= LOW_M or foot >= HIGH_M:
                continue
            place = np.array(keys["at"][:2], float), size[:2], degrees(keys.get("yaw", 0))
            here = inside(points, *place, -resolution / 2)
            near |= inside(points, *place, ROOM_M)
            if kind != "chair":
                furniture |= here
                by_kind.setdefault(kind, []).append((int((state[here] == 254).sum()), int(here.sum())))
        elif "at" in keys and kind not in ("lamp", "poster", "picture", "sign", "whiteboard", "monitor", "clutter"):
            reach = 0.5 * max(keys.get("width", 0.6), 2 * keys.get("radius", 0.3)) + ROOM_M
            near |= np.linalg.norm(points - np.array(keys["at"][:2], float), axis=1) < reach

    room = floor & ~near
    wrong = (state[furniture] == 254).mean()
    right = (state[room] == 254).mean()
    blocked = (state[room] == 0).mean()
    for kind, counts in sorted(by_kind.items()):
        print(f"{kind}: {sum(n for n, _ in counts)} of {sum(n for _, n in counts)} cells inside are free")
    print(f"inside furniture {100 * wrong:.2f} % of {furniture.sum()} cells are free, "
          f"{100 * (state[furniture] == 0).mean():.1f} % occupied")
    print(f"of {room.sum()} cells with room around them {100 * right:.1f} % are free, {100 * blocked:.2f} % occupied")
    if wrong > MOST_INSIDE:
        sys.exit("cells inside furniture are free")
    if right < LEAST_OUTSIDE:
        sys.exit("free cells are not known as such")


if __name__ == "__main__":
    main()
