#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Maps a recording and looks at what came out: map_folder.py RECORDING OUT"""
import sys

import numpy as np

import plumbline


def main(recording: str, out: str) -> int:
    def show(done: int, total: int) -> None:
        print(f"\r{done} of {total} frames", end="", file=sys.stderr, flush=True)

    result = plumbline.map(recording, out, force=True, progress=show)
    print(file=sys.stderr)
    if not result.trustworthy:
        print("careful:", result.reason)

    # The path, and how far the camera went.
    steps = np.diff(result.trajectory.positions, axis=0)
    print(f"{len(result.trajectory)} poses, {np.linalg.norm(steps, axis=1).sum():.2f} m of path")

    # The cloud is an array: here the floor, seen from above.
    cloud = result.cloud
    floor = cloud.points[(np.abs(cloud.points[:, 2]) < 0.05) & (cloud["confidence"] > 0.5)]
    print(f"{len(cloud)} points, {len(floor)} of them on the floor")

    # Thinner, and without what is alone; then a file for any viewer and a picture.
    thin = plumbline.filter(cloud, [{"type": "voxel_grid", "leaf": "3 cm"}, {"type": "radius_outlier"}])
    thin.to_ply(result.folder / "thin.ply")
    plumbline.render(result, "iso", size=(800, 600), file=result.folder / "iso.png")
    print("written", result.folder / "thin.ply", "and", result.folder / "iso.png")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2]))
