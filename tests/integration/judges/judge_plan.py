# SPDX-License-Identifier: BSD-3-Clause
"""judge_plan.py PLAN.dxf SCENE.yaml SCENE.json TRAJECTORY.txt: a plan against the walls of the scene file.

The world's frame and the map's differ by where the camera began (SCENE.json, the first line of TRAJECTORY.txt);
what that leaves is removed by fitting the walls' positions rigidly. Prints a table and fails on what is off.
"""
import json
import math
import sys

import ezdxf
import numpy as np
import yaml

ANGLE = math.radians(3.0)
WALL_M, LENGTH_M, DOOR_M = 0.005, 0.01, 0.10


def yaw_of(q):
    """Direction seen from above of a camera's axis z; q as x, y, z, w."""
    x, y, z, w = q
    return math.atan2(2 * (y * z - x * w), 2 * (x * z + y * w))


def turned(points, yaw, shift):
    c, s = math.cos(yaw), math.sin(yaw)
    return np.asarray(points) @ np.array([[c, s], [-s, c]]) + shift


def scene_from_map(start_file, path_file):
    """Turn and shift, seen from above, of the map's frame in the scene's."""
    start = json.load(open(start_file))["robots"][0]["start"]
    first = [float(v) for v in next(line for line in open(path_file) if line[0] != "#").split()]
    yaw = yaw_of(start["quaternion_xyzw"]) - yaw_of(first[4:8])
    return yaw, np.array(start["position_m"][:2]) - turned([first[1:3]], yaw, 0)[0]


def truth_of(scene):
    """Sides of walls as (start, end), doors that stand open as (middle, width), corners."""
    sides, doors = [], []
    for thing in scene["objects"]:
        wall = thing.get("wall")
        if wall is None:
            continue
        a, b = np.array(wall["from"], float), np.array(wall["to"], float)
        t = (b - a) / np.linalg.norm(b - a)
        n = np.array([-t[1], t[0]]) * 0.5 * float(wall.get("thickness", 0.12))
        sides += [(a + n, b + n), (a - n, b - n)]
        for door in wall.get("doors", []):
            if str(door.get("open", "0")).split()[0] != "0":
                doors.append((a + t * (door["at"] + 0.5 * door["width"]), door["width"]))
    return sides, doors


def corners_of(sides):
    """Where two sides that are not parallel meet, or one ends at the other."""
    corners = []
    for i, (a, b) in enumerate(sides):
        for c, d in sides[i + 1:]:
            u, v = b - a, d - c
            cross = u[0] * v[1] - u[1] * v[0]
            if abs(cross) < 0.1 * np.linalg.norm(u) * np.linalg.norm(v):
                continue
            s = ((c - a)[0] * v[1] - (c - a)[1] * v[0]) / cross
            r = ((c - a)[0] * u[1] - (c - a)[1] * u[0]) / cross
            if all(-0.2 < x * np.linalg.norm(w) < np.linalg.norm(w) + 0.2 for x, w in ((s, u), (r, v))):
                corners.append(a + s * u)
    return np.array(corners)


def whole_lines(pieces, doors):
    """Pieces of one side of a wall, joined over its doors: (start, end)."""
    rest = [np.array(p) for p in pieces]
    joined = []
    while rest:
        line = rest.pop()
        grown = True
        while grown:
            grown = False
            t = (line[1] - line[0]) / np.linalg.norm(line[1] - line[0])
            n = np.array([-t[1], t[0]])
            for k, other in enumerate(rest):
                if np.abs((other - line[0]) @ n).max() > 0.001:
                    continue
                s = np.sort((other - line[0]) @ t)
                length = np.linalg.norm(line[1] - line[0])
                gap = max(s[0] - length, -s[1])
                if gap > 2.5:
                    continue
                middle = line[0] + t * (length + gap / 2 if s[0] > 0 else -gap / 2)
                if gap > 0.01 and not any(np.linalg.norm(middle - m) < 0.3 for m in doors):
                    continue
                ends = np.sort(np.append((other - line[0]) @ t, [0.0, length]))
                line = np.array([line[0] + ends[0] * t, line[0] + ends[-1] * t])
                rest.pop(k)
                grown = True
                break
        joined.append(line)
    return joined


def match(line, sides):
    """Side of the truth along this line, and how far the line's middle is from it; None: there is none."""
    t = (line[1] - line[0]) / np.linalg.norm(line[1] - line[0])
    best = None
    for a, b in sides:
        u = (b - a) / np.linalg.norm(b - a)
        if abs(u[0] * t[1] - u[1] * t[0]) > math.sin(ANGLE):
            continue
        n = np.array([-u[1], u[0]])
        middle = line.mean(axis=0)
        off, s = (middle - a) @ n, (middle - a) @ u
        if -0.2 < s < np.linalg.norm(b - a) + 0.2 and abs(off) < 0.058 and (best is None or abs(off) < abs(best[0])):
            best = (off, n)
    return best


def fitted(lines, sides, yaw, shift):
    """The rigid motion that lays the lines on the sides best; median weights against furniture."""
    for _ in range(10):
        rows, offs = [], []
        for line in lines:
            here = turned(line, yaw, shift)
            found = match(here, sides)
            if found is None:
                continue
            off, n = found
            way = here.mean(axis=0) - shift
            weight = 1.0 / (1.0 + (off / 0.01) ** 2)
            rows.append(weight * np.array([n @ np.array([-way[1], way[0]]), n[0], n[1]]))
            offs.append(-weight * off)
        if len(rows) < 3:
            sys.exit("fewer than three lines of the plan lie beside walls of the scene")
        step = np.linalg.lstsq(np.array(rows), np.array(offs), rcond=None)[0]
        yaw, shift = yaw + step[0], shift + step[1:]
    return yaw, shift


def main():
    plan, scene_file, start_file, path_file = sys.argv[1:5]
    scene = yaml.safe_load(open(scene_file))
    yaw, shift = scene_from_map(start_file, path_file)

    space = ezdxf.readfile(plan).modelspace()
    ends = lambda layer: [np.array([list(e.dxf.start)[:2], list(e.dxf.end)[:2]])
                          for e in space.query(f'LINE[layer=="{layer}"]')]
    edges = ends("A-DOOR")  # of both sides of the wall, one after the other
    pieces, drawn_doors = ends("A-WALL"), [0.5 * (a + b) for a, b in zip(edges[0::2], edges[1::2])]
    windows = [np.array([w.ocs().to_wcs(w.dxf.insert), w.matrix44().transform((1, 1, 0))])[:, :2]
               for w in space.query('INSERT[layer=="A-GLAZ"]')]
    jambs = [end for door in drawn_doors for end in door]
    long = [p for p in pieces if np.linalg.norm(p[1] - p[0]) > 0.3]
    sides, doors = truth_of(scene)
    yaw, shift = fitted(long, sides, yaw, shift)

    lines = whole_lines(long, [door.mean(axis=0) for door in [*drawn_doors, *ends("A-GLAZ"), *windows]])
    corners = corners_of(sides)
    offs, lengths, strange, table = [], [], [], []
    for line in lines:
        here = turned(line, yaw, shift)
        found = match(here, sides)
        length = np.linalg.norm(here[1] - here[0])
        if found is None:
            strange.append((here.round(2).tolist(), round(length, 2)))
            continue
        offs.append(found[0])
        table.append((here.round(2).tolist(), f"{1e3 * found[0]:+.1f} mm"))
        near = [corners[np.argmin(np.linalg.norm(corners - end, axis=1))] for end in here]
        if length >= 1.0 and max(np.linalg.norm(near[k] - here[k]) for k in range(2)) < 0.05:
            lengths.append(length - np.linalg.norm(near[1] - near[0]))
    offs, lengths = np.array(offs), np.array(lengths)

    found, invented = set(), []
    for door in drawn_doors:
        middle = turned(door, yaw, shift).mean(axis=0)
        width = np.linalg.norm(door[1] - door[0])
        which = [k for k, (m, _) in enumerate(doors) if np.linalg.norm(m - middle) < DOOR_M + 0.06]
        found.update(which)
        if not which:
            invented.append((middle.round(2).tolist(), round(width, 2)))
    path = turned([[float(v) for v in line.split()[1:3]] for line in open(path_file) if line[0] != "#"], yaw, shift)
    passed = {k for k, (m, _) in enumerate(doors) if np.linalg.norm(path - m, axis=1).min() < 0.5}

    print(f"{len(lines)} lines of walls, {len(strange)} beside no wall of the scene: {strange}")
    print("\n".join(f"{ends}: {off}" for ends, off in table))
    print(f"offsets mm: median {1e3 * np.median(np.abs(offs)):.1f}, largest {1e3 * np.abs(offs).max():.1f}")
    print(f"lengths of {len(lengths)} walls from corner to corner, mm off: {(1e3 * lengths).round(1).tolist()}")
    print(f"doors: {len(found & passed)} of {len(passed)} that the camera went through ({len(found)} of {len(doors)}"
          f" in the scene), missing {[doors[k][0].round(2).tolist() for k in sorted(passed - found)]}, invented {invented}")
    wrong = []
    if np.abs(offs).max() > WALL_M:
        wrong.append(f"a wall is {1e3 * np.abs(offs).max():.1f} mm off")
    if len(lengths) and np.abs(lengths).max() > LENGTH_M:
        wrong.append(f"a length is {1e3 * np.abs(lengths).max():.1f} mm off")
    if len(found & passed) < 0.9 * len(passed):
        wrong.append("doors are missing")
    if invented:
        wrong.append("doors are invented")
    if strange:
        wrong.append("walls are invented")
    if wrong:
        sys.exit("; ".join(wrong))


if __name__ == "__main__":
    main()
