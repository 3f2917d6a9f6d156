# SPDX-License-Identifier: BSD-3-Clause
"""RGB-D recordings in, one dense metric point cloud out.

    import plumbline

    result = plumbline.map("recording", "out/kitchen")
    print(result.summary["frames"], result.trustworthy)
    points = result.cloud.points                       # N x 3, metres
    plumbline.render(result, "top", file="plan.png")

All lengths are metres, all times seconds, poses 4 x 4 matrices world_from_camera. Warnings go to the logger "plumbline".
Long calls leave the interpreter to other threads. Errors are exceptions below plumbline.Error, with the message that
the program would print: ConfigError (exit code 2), InputError (3), UntrustworthyError (4), OutputError (5),
InternalError (1, a bug).
"""
from ._cloud import Cloud, FilterReport, filter
from ._core import (
    Camera,
    ConfigError,
    Error,
    InputError,
    InternalError,
    OutputError,
    UntrustworthyError,
    version as __version__,
)
from ._measures import Changes, Report, compare, evaluate_cloud, evaluate_trajectory, export, render
from ._recording import Frame, Recording, camera, open
from ._result import Keyframes, Landmarks, Length, Localization, Result, load
from ._runs import Mapper, Tracked, adjust, fuse, localize, map
from ._trajectory import Trajectory

__all__ = [
    "adjust", "Camera", "Changes", "Cloud", "ConfigError", "Error", "FilterReport", "Frame", "InputError", "InternalError",
    "Keyframes", "Landmarks", "Length", "Localization", "Mapper", "OutputError", "Recording", "Report", "Result", "Tracked",
    "Trajectory", "UntrustworthyError", "__version__", "camera", "compare", "evaluate_cloud", "evaluate_trajectory", "export",
    "filter", "fuse", "load", "localize", "map", "open", "render",
]
