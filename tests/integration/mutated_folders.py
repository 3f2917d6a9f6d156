#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Damaged recordings of every layout: mutated_folders.py PROGRAM FOLDER [COUNT [SEED]]

Small recordings are written in each layout (layouts.py), then COUNT times (default 500) one of them is copied, one to
three of its files are damaged, renamed or taken away, and the program is run on it: `info`, every tenth time `map`. It
has 3 GB of address space and 10 s. What it may say is 0, 2, 3 or 4; whatever else is told with the command that
repeats it. Exit code 77 where OpenCV for Python is missing.
"""
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import time

import layouts
from layouts import cv2, np

SIZE = (160, 120)
FRAMES = 6


class Tiny(layouts.Recording):
    """A wall with a pattern that moves a little."""

    def __init__(self):
        self.rows = [[f"{1 + i / 30:.6f}"] for i in range(FRAMES)]
        self.k = np.array([[130.0, 0, 79.5], [0, 130.0, 59.5], [0, 0, 1]])
        self.size = SIZE
        self.scale = 1000
        self.pattern = cv2.GaussianBlur(np.random.default_rng(1).integers(0, 256, (200, 240, 3)).astype(np.uint8), (0, 0), 2) * 2

    def color(self, i):
        return self.pattern[10 + i : 10 + i + SIZE[1], 10 + 2 * i : 10 + 2 * i + SIZE[0]].copy()

    def metres(self, i):
        return np.full(SIZE[::-1], 2.0, np.float32)

    def pose(self, i):
        m = np.eye(4)
        m[0, 3] = 0.03 * i
        return m


def replica(rec, d):
    layouts.fresh(d, "results")
    for i in range(len(rec)):
        cv2.imwrite(f"{d}/results/frame{i:06d}.jpg", rec.color(i))
        cv2.imwrite(f"{d}/results/depth{i:06d}.png", rec.millimetres(i))
    np.savetxt(f"{d}/traj.txt", [rec.pose(i).ravel() for i in range(len(rec))])
    layouts.write(f"{d}/cam_params.json", '{"camera": {"w": 160, "h": 120, "fx": 130, "fy": 130, "cx": 79.5, "cy": 59.5, "scale": 1000}}')


def scannet(rec, d):
    layouts.fresh(d, "color", "depth", "pose", "intrinsic")
    for i in range(len(rec)):
        cv2.imwrite(f"{d}/color/{i}.jpg", cv2.resize(rec.color(i), (320, 240)))
        cv2.imwrite(f"{d}/depth/{i}.png", rec.millimetres(i))
        np.savetxt(f"{d}/pose/{i}.txt", rec.pose(i))
    np.savetxt(f"{d}/intrinsic/intrinsic_color.txt", layouts.resized(rec.k, SIZE, (320, 240)))
    np.savetxt(f"{d}/intrinsic/intrinsic_depth.txt", rec.k)


def stray(rec, d):
    layouts.fresh(d, "depth", "confidence")
    film = cv2.VideoWriter(f"{d}/rgb.mp4", cv2.VideoWriter_fourcc(*"mp4v"), 30, (320, 240))
    rows = "timestamp, frame, x, y, z, qx, qy, qz, qw\n"
    for i in range(len(rec)):
        film.write(cv2.resize(rec.color(i), (320, 240)))
        cv2.imwrite(f"{d}/depth/{i:06d}.png", rec.millimetres(i))
        cv2.imwrite(f"{d}/confidence/{i:06d}.png", np.full(SIZE[::-1], 2, np.uint8))
        rows += f"{1 + i / 30}, {i:06d}, {0.03 * i}, 0, 0, 0, 0, 0, 1\n"
    film.release()
    layouts.write(f"{d}/odometry.csv", rows)
    layouts.write(f"{d}/camera_matrix.csv", "260,0,159.5\n0,260,119.5\n0,0,1\n")


def tum(rec, d):
    layouts.tum_lists(rec, d, rec.color, rec.millimetres, layouts.camera_yaml(rec.k, SIZE, 1000))
    layouts.write(f"{d}/groundtruth.txt", "".join(f"{1 + i / 30:.6f} {0.03 * i} 0 0 0 0 0 1\n" for i in range(FRAMES)))


def tum_tiff(rec, d):
    layouts.tum_lists(rec, d, rec.color, rec.metres, layouts.camera_yaml(rec.k, SIZE, 1000), ".tiff")


def redwood(rec, d):
    layouts.fresh(d, "color", "depth")
    for i in range(len(rec)):
        cv2.imwrite(f"{d}/color/{i:05d}.jpg", rec.color(i))
        cv2.imwrite(f"{d}/depth/{i:05d}.png", rec.millimetres(i))
    layouts.write(f"{d}/intrinsic.json", '{"width": 160, "height": 120, "intrinsic_matrix": [130, 0, 0, 0, 130, 0, 79.5, 59.5, 1]}')


WRITERS = [tum, tum_tiff, redwood, replica, scannet, stray, layouts.seven_scenes, layouts.tartanair, layouts.record3d,
           layouts.polycam, layouts.two_sizes, layouts.fisheye]


def mutate(file, files, chance):
    """One change to a file: of bytes, of a number, of its length, of its name or of what it is."""
    kind = chance.randrange(9)
    data = bytearray(open(file, "rb").read()) if os.path.isfile(file) else bytearray()
    at = chance.randrange(len(data)) if data else 0
    if kind == 0 and data:
        for _ in range(chance.randrange(1, 20)):
            data[chance.randrange(len(data))] = chance.randrange(256)
    elif kind == 1:
        del data[at:]
    elif kind == 2:
        data[at:at] = bytes(chance.randrange(256) for _ in range(chance.randrange(1, 40)))
    elif kind == 3:  # a number becomes another one
        numbers = list(re.finditer(rb"\d+", data))
        if numbers:
            m = chance.choice(numbers)
            data[m.start() : m.end()] = chance.choice([b"0", b"-1", b"nan", b"inf", b"1e308", b"4294967296", b"99999999999999999999", b""])
    elif kind == 4:
        os.remove(file)
        return
    elif kind == 5:
        os.remove(file)
        os.makedirs(file, exist_ok=True)
        return
    elif kind == 6:  # the contents of another file of the recording
        other = chance.choice(files)
        data = bytearray(open(other, "rb").read()) if os.path.isfile(other) else bytearray()
    elif kind == 7:
        base, extension = os.path.splitext(file)
        os.replace(file, chance.choice([base, base + "0" + extension, base[:-1] + extension, base + ".png", base + "é " + extension]) or file)
        return
    else:
        data = bytearray()
    with open(file, "wb") as out:
        out.write(data)


def limit_memory():
    resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def run(program, folder, place, mapped):
    command = [program, "info", place]
    if mapped:
        command = [program, "map", place, "-o", f"{folder}/out", "--force", "-q", "--threads", "1", "--set", "output.views="]
    start = time.monotonic()
    try:
        ran = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=120, preexec_fn=limit_memory)
        code, told = ran.returncode, ran.stderr
    except subprocess.TimeoutExpired:
        code, told = None, "no end after 120 s"
    spent = time.monotonic() - start
    spent_by_it = resource.getrusage(resource.RUSAGE_CHILDREN)
    return code, told, spent, spent_by_it.ru_utime + spent_by_it.ru_stime


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    program, folder = sys.argv[1:3]
    count = int(sys.argv[3]) if len(sys.argv) > 3 else 500
    first = int(sys.argv[4]) if len(sys.argv) > 4 else 0
    os.makedirs(folder, exist_ok=True)
    whole = {}
    for writer in WRITERS:
        place = f"{folder}/whole/{writer.__name__}"
        whole[writer.__name__] = writer(Tiny(), place) or place
        code, told, _, _ = run(program, folder, whole[writer.__name__], False)
        if code != 0:
            sys.exit(f"{writer.__name__}: undamaged, and still code {code}: {told}")

    codes, failures, before = {}, 0, 0.0
    for number in range(first, first + count):
        chance = random.Random(number)
        name = chance.choice(sorted(whole))
        place = f"{folder}/{name}"
        shutil.rmtree(place, ignore_errors=True)
        shutil.copytree(whole[name], place)
        files = sorted(os.path.join(at, f) for at, _, inside in os.walk(place) for f in inside)
        small = [f for f in files if not f.endswith((".png", ".jpg", ".tiff", ".npy", ".exr"))]
        for _ in range(chance.randrange(1, 4)):
            file = chance.choice(small if small and chance.random() < 0.6 else files)
            if os.path.isfile(file):
                mutate(file, files, chance)
        code, told, spent, total = run(program, folder, place, number % 10 == 0)
        codes[code] = codes.get(code, 0) + 1
        if code not in (0, 2, 3, 4) or total - before > 10:
            failures += 1
            print(f"FAILED {name}, number {number}: code {code} after {spent:.1f} s: {told.strip()[-500:]}\n"
                  f"       again: {sys.argv[0]} {program} {folder} 1 {number}", flush=True)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        before = before.ru_utime + before.ru_stime
    print(f"{count} damaged recordings; codes: {codes}; {failures} failures")
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
