# SPDX-License-Identifier: BSD-3-Clause
"""judge_layout.py TRUTH MAP PLAN.json [...]: exported plans against the plan.json of worlds made from a number.

TRUTH is a folder of `plumbline synth ... --layout N`, MAP the result folder of the same frames, PLAN.json what
`plumbline export MAP -o PLAN.json` wrote; three arguments a world. What the first pose leaves of the map's place in
the world is removed by laying the walls on those of the truth. A face counts as seen along its whole length where
half of its surface was seen; openings count whose jambs were seen to a half or more.
"""
import json
import math
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "integration" / "judges"))
from judge_plan import fitted, match, turned, yaw_of  # noqa: E402

SEEN, CELL_M = 0.8, 0.02


def inside(outline, points):
    result = np.zeros(len(points), bool)
    for a, b in zip(outline, np.roll(outline, -1, axis=0)):
        crossed = (a[1] > points[:, 1]) != (b[1] > points[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            x = a[0] + (points[:, 1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        result ^= crossed & (points[:, 0] < x)
    return result


def overlap(a, b):
    """Share of both outlines' area that they have in common."""
    both = np.vstack([a, b])
    x, y = (np.arange(low, high, 2 * CELL_M) for low, high in zip(both.min(0), both.max(0)))
    points = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
    in_a, in_b = inside(a, points), inside(b, points)
    return (in_a & in_b).sum() / max(1, (in_a | in_b).sum())


def judge(truth_dir, map_dir, plan_file):
    truth = json.load(open(f"{truth_dir}/plan.json"))
    plan = json.load(open(plan_file))
    start = np.array(truth["robots"][0]["world_from_first_camera"])
    first = [float(v) for v in next(line for line in open(f"{map_dir}/trajectory.txt") if line[0] != "#").split()]
    yaw = math.atan2(start[1, 2], start[0, 2]) - yaw_of(first[4:8])
    shift = start[:2, 3] - turned([first[1:3]], yaw, 0)[0]
    faces = [(np.array(f["from_m"]), np.array(f["to_m"]), f) for r in truth["rooms"] for f in r["faces"]]
    sides = [f[:2] for f in faces]
    walls = [np.array([w["from_m"], w["to_m"]]) for w in plan["walls"]]
    yaw, shift = fitted([w for w in walls if np.linalg.norm(w[1] - w[0]) > 0.6], sides, yaw, shift)
    here = lambda points: turned(points, yaw, shift)
    out = {"rooms": [0, 0], "area": [], "false_rooms": 0, "open": [0, 0], "width": [], "invented": 0, "windows": [0, 0],
           "strange": 0, "offsets": [], "lengths": []}
    print(f"== {plan_file}: {len(walls)} walls, {len(plan['rooms'])} rooms, {len(plan['openings'])} openings")

    # Rooms.
    rooms = [(here(r["outline_m"]), r) for r in plan["rooms"]]
    used = set()
    for room in truth["rooms"]:
        lengths = [math.dist(f["from_m"], f["to_m"]) for f in room["faces"]]
        seen = sum(n * min(1.0, 2.0 * f["seen"]) for n, f in zip(lengths, room["faces"])) / sum(lengths)
        outline = np.array(room["outline_m"])
        shares = [overlap(outline, r[0]) for r in rooms]
        best = int(np.argmax(shares)) if shares else -1
        good = best >= 0 and shares[best] > 0.7
        closed = good and rooms[best][1]["closed"]
        error = (rooms[best][1]["area_m2"] / room["area_m2"] - 1.0) * 100 if good else math.nan
        used |= {best} if good else set()
        if seen >= SEEN:
            out["rooms"][0] += closed
            out["rooms"][1] += 1
            if closed:
                out["area"].append(abs(error))
        print(f"  {room['kind']:9} {room['area_m2']:6.2f} m2, seen {100 * seen:3.0f} %: " +
              (f"room {rooms[best][1]['number']} {'closed' if closed else 'open'} area {error:+.2f} %" if good else
               f"none (best {100 * max(shares, default=0):.0f} %)"))
        if not good:
            continue
        for a, b in zip(rooms[best][0], np.roll(rooms[best][0], -1, axis=0)):  # its sides, corner to corner
            ends = [np.linalg.norm(outline - e, axis=1) for e in (a, b)]
            if max(e.min() for e in ends) < 0.12 and ends[0].argmin() != ends[1].argmin():
                true = np.linalg.norm(outline[ends[0].argmin()] - outline[ends[1].argmin()])
                out["lengths"].append(abs(np.linalg.norm(b - a) - true))
    out["false_rooms"] = sum(r["closed"] and i not in used for i, (_, r) in enumerate(rooms))

    # Openings.
    mine = [(here(o["jambs_m"]), o) for o in plan["openings"]]
    taken = set()
    for o in truth["openings"]:
        jambs = np.array(o["jambs_m"])
        along = (jambs[1] - jambs[0]) / o["width_m"]
        near = []
        for i, (ours, _) in enumerate(mine):
            off = ours.mean(axis=0) - jambs.mean(axis=0)
            if abs(off @ along) < 0.5 * o["width_m"] and abs(off @ [-along[1], along[0]]) < 0.5 * o["depth_m"] + 0.15:
                near.append((abs(off @ along), i))
        which = min(near)[1] if near else None
        taken |= {i for _, i in near}
        wanted = o["kind"] in ("door", "passage") and o.get("leaf") != "shut" and o["jambs_seen"] >= 0.5
        group = "windows" if o["kind"] == "window" and o["jambs_seen"] >= 0.5 else "open" if wanted else None
        error = (mine[which][1]["width_m"] - o["width_m"]) * 1e3 if which is not None else math.nan
        if group:
            out[group][0] += which is not None
            out[group][1] += 1
            if which is not None and group == "open":
                out["width"].append(abs(error))
        if group or which is not None:
            print(f"  {o['kind']} {o.get('leaf', '')} {o['width_m']:.3f} m at {jambs.mean(axis=0).round(2)}, jambs "
                  f"{o['jambs_seen']:.2f}: " + ("missing" if which is None else
                  f"{mine[which][1]['kind']} {error:+.1f} mm"))
    for i, (ours, o) in enumerate(mine):
        if i not in taken:
            out["invented"] += 1
            print(f"  invented {o['kind']} {o['width_m']:.2f} m at {ours.mean(axis=0).round(2)}")

    # Walls.
    for wall in map(here, walls):
        length = np.linalg.norm(wall[1] - wall[0])
        if length < 0.3:
            continue
        found = match(wall, sides)
        if found is None:
            out["strange"] += 1
            print(f"  no wall there: {wall.round(2).tolist()}, {length:.2f} m")
        else:
            out["offsets"].append(abs(found[0]))
    return out


def main():
    args = sys.argv[1:]
    all_of = [judge(*args[i:i + 3]) for i in range(0, len(args), 3)]
    total = lambda key: sum(np.array(o[key]) for o in all_of)
    joined = lambda key: np.array(sum((list(o[key]) for o in all_of), [])) if all_of else np.array([])
    most = lambda key, by=1.0: (f"median {by * np.median(joined(key)):.2f}, worst {by * joined(key).max():.2f}"
                                if len(joined(key)) else "none")
    print(f"{len(all_of)} worlds\nrooms closed: {total('rooms')[0]} of {total('rooms')[1]}; area off by %: "
          f"{most('area')}; closed beside every room: {total('false_rooms')}")
    print(f"openings: {total('open')[0]} of {total('open')[1]}, invented {total('invented')} (none in "
          f"{sum(o['invented'] == 0 for o in all_of)} worlds); width mm: {most('width')}; "
          f"windows {total('windows')[0]} of {total('windows')[1]}")
    print(f"walls without counterpart: {total('strange')} (none in {sum(o['strange'] == 0 for o in all_of)} worlds); "
          f"offsets mm: {most('offsets', 1e3)}; lengths mm: {most('lengths', 1e3)}")


if __name__ == "__main__":
    main()
