#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Maps frames as a camera gives them: camera_loop.py RECORDING OUT

A recording plays the camera here. Put the frames of your own driver in its place: color as OpenCV has it (blue first),
depth as 16-bit integers in units of 1 / depth_scale metres, the stamp in seconds.
"""
import sys
import time
from typing import Iterator

import plumbline


def camera_frames(recording: plumbline.Recording) -> Iterator[plumbline.Frame]:
    """The frames at the camera's own pace."""
    begin = time.monotonic()
    first = recording.stamps[0]
    for frame in recording:
        time.sleep(max(0.0, begin + frame.stamp - first - time.monotonic()))
        yield frame


def main(source: str, out: str) -> int:
    recording = plumbline.open(source, raw=True)
    with plumbline.Mapper(recording.camera, output=out, drop_late=True, force=True) as mapper:
        for frame in camera_frames(recording):
            tracked = mapper.feed(frame.color, frame.depth, frame.stamp, depth_stamp=frame.depth_stamp)
            if tracked.pose is not None:  # waits for the tracker; ask for it later, or not at all, to go on at once
                x, y, z = tracked.pose[:3, 3]
                print(f"{frame.stamp:.3f} s: {x:+.3f} {y:+.3f} {z:+.3f} m{' keyframe' if tracked.keyframe else ''}")
        result = mapper.finish()
    print(f"{mapper.fed} frames mapped, {mapper.dropped} left out; see {result.folder}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2]))
