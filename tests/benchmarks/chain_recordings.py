#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Puts recordings one behind the other as a single one: a robot that was carried elsewhere.

chain_recordings.py OUT FIRST NEXT...      folders with associations.txt and camera.yaml; NEXT may be FOLDER:mirror,
                                           which is turned about its vertical axis: a mirrored place
Images of NEXT become those of FIRST's camera (without distortion). With python3-opencv and python3-yaml.
"""
import sys
from pathlib import Path

import cv2
import numpy as np
import yaml


def read(folder):
    camera = yaml.safe_load((folder / "camera.yaml").read_text())
    lines = (line.split() for line in (folder / "associations.txt").read_text().splitlines() if line[0] != "#")
    return camera, [(float(a), b, float(c), d) for a, b, c, d in lines]


def as_camera(image, source, target, interpolation):
    """The image that the target's camera sees; both without distortion."""
    if all(source[k] == target[k] for k in ("fx", "fy", "cx", "cy")):
        return image
    u, v = np.meshgrid(np.arange(target["width"], dtype=np.float32), np.arange(target["height"], dtype=np.float32))
    x = (u - target["cx"]) / target["fx"] * source["fx"] + source["cx"]
    y = (v - target["cy"]) / target["fy"] * source["fy"] + source["cy"]
    return cv2.remap(image, x.astype(np.float32), y.astype(np.float32), interpolation)


def mirrored(image, camera):
    """Seen in a mirror, by the same camera."""
    turned = dict(camera, cx=camera["width"] - 1 - camera["cx"])
    return as_camera(np.ascontiguousarray(image[:, ::-1]), turned, camera, cv2.INTER_NEAREST)


def main(out, names):
    out.mkdir()
    (out / "rgb").mkdir()
    (out / "depth").mkdir()
    first, rows, shift, last = None, [], 0.0, 0.0
    for name in names:
        folder, _, turned = name.partition(":")
        camera, frames = read(Path(folder))
        first = first or camera
        if rows:
            shift = last + 1.0 / first.get("fps", 30) - frames[0][0]
        for stamp, color_name, depth_stamp, depth_name in frames:
            color = cv2.imread(str(Path(folder, color_name)), cv2.IMREAD_COLOR)
            depth = cv2.imread(str(Path(folder, depth_name)), cv2.IMREAD_UNCHANGED)
            if turned:
                color, depth = mirrored(color, camera), mirrored(depth, camera)
            color = as_camera(color, camera, first, cv2.INTER_LINEAR)
            depth = as_camera(depth, camera, first, cv2.INTER_NEAREST)
            scale = first.get("depth_scale", 5000) / camera.get("depth_scale", 5000)
            depth = np.where(depth * scale < 65535, np.round(depth * scale), 0).astype(np.uint16)
            stamps = stamp + shift, depth_stamp + shift
            files = f"rgb/{stamps[0]:.6f}.png", f"depth/{stamps[1]:.6f}.png"
            cv2.imwrite(str(out / files[0]), color)
            cv2.imwrite(str(out / files[1]), depth)
            rows.append(f"{stamps[0]:.6f} {files[0]} {stamps[1]:.6f} {files[1]}")
            last = stamps[0]
    (out / "associations.txt").write_text("\n".join(rows) + "\n")
    (out / "camera.yaml").write_text(yaml.safe_dump(first))


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), sys.argv[2:])
