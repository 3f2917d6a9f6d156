#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Whether two TUM folders hold the same images, as OpenCV reads them: compare_folders.py REFERENCE FOLDER TOLERANCE_M"""
import sys
from pathlib import Path

import cv2
import numpy as np


def rows_of(folder):
    text = (folder / "associations.txt").read_text()
    return [line.split() for line in text.splitlines() if line.strip() and not line.startswith("#")]


def metres_of(image, scale):
    return image.astype(np.float64) if image.dtype == np.float32 else image.astype(np.float64) / scale


def scale_of(folder):
    lines = (folder / "camera.yaml").read_text().splitlines()
    return next(float(line.split(":")[1].split("#")[0]) for line in lines if line.startswith("depth_scale"))


def main():
    a, b, tolerance = Path(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[3])
    rows_a, rows_b = rows_of(a), rows_of(b)
    if len(rows_a) != len(rows_b):
        print(f"{len(rows_a)} and {len(rows_b)} frames")
        return 1
    worst = 0.0
    for one, other in zip(rows_a, rows_b):
        if [float(one[0]), float(one[2])] != [float(other[0]), float(other[2])]:
            print(f"stamps {one[0]} {one[2]} and {other[0]} {other[2]}")
            return 1
        color = [cv2.imread(str(f / r[1]), cv2.IMREAD_COLOR) for f, r in ((a, one), (b, other))]
        depth = [metres_of(cv2.imread(str(f / r[3]), cv2.IMREAD_UNCHANGED), scale_of(f)) for f, r in ((a, one), (b, other))]
        if not np.array_equal(*color):
            print(f"{one[1]} and {other[1]} differ")
            return 1
        worst = max(worst, float(np.abs(depth[0] - depth[1]).max()))
    print(f"{len(rows_a)} frames the same, depth within {worst} m")
    return 0 if worst <= tolerance else 1


sys.exit(main())
