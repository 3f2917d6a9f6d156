# SPDX-License-Identifier: BSD-3-Clause
"""Stamped camera poses."""
from __future__ import annotations

import functools
import os
from pathlib import Path
from typing import Optional, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _core
from ._values import PathLike, path_of


class Trajectory:
    """Camera poses by time.

    stamps  N, seconds, ascending
    poses   N x 4 x 4, world_from_camera: metres; the camera's axes are x right, y down, z forward
    """

    def __init__(self, stamps: npt.ArrayLike, poses: npt.ArrayLike) -> None:
        self.stamps: npt.NDArray[np.float64] = np.asarray(stamps, dtype=np.float64)
        self.poses: npt.NDArray[np.float64] = np.asarray(poses, dtype=np.float64)
        self._kept: Optional[Tuple[Path, str]] = None  # result folder and robot, where the covariance is
        if self.poses.ndim != 3 or self.poses.shape[1:] != (4, 4) or len(self.stamps) != len(self.poses):
            raise _core.InputError(
                f"a trajectory has N stamps and N x 4 x 4 poses, not {self.stamps.shape} and {self.poses.shape}"
            )

    @classmethod
    def read(cls, file: PathLike) -> "Trajectory":
        """Reads a file in TUM, EuRoC or KITTI format, or a result folder's trajectory.txt. Raises InputError."""
        path = path_of(file, "file")
        if os.path.isdir(path):
            path = os.path.join(path, "trajectory.txt")
        return cls(*_core.read_trajectory(path))

    def write(self, file: PathLike) -> None:
        """Writes TUM format. Raises OutputError."""
        _core.write_trajectory(path_of(file, "file"), self.stamps, self.poses)

    @property
    def positions(self) -> npt.NDArray[np.float64]:
        """N x 3, metres."""
        return self.poses[:, :3, 3]

    @functools.cached_property
    def covariance(self) -> Optional[npt.NDArray[np.float64]]:
        """N x 6 x 6, of the position (metres) and of small rotations about the world's axes (radians), relative to the
        first keyframe; frames between keyframes have that of the keyframe before. None: not known; it needs the
        stage refine and a map.db."""
        return None if self._kept is None else _core.pose_covariances(*self._kept, self.stamps, self.poses)

    def __len__(self) -> int:
        return len(self.stamps)

    def __repr__(self) -> str:
        return f"<plumbline.Trajectory: {len(self)} poses>"


TrajectoryLike = Union[Trajectory, PathLike]


def trajectory_of(given: object) -> Trajectory:
    """A Trajectory, a Result, a file, or a result folder."""
    if isinstance(given, Trajectory):
        return given
    own = getattr(given, "trajectory", None)
    return own if isinstance(own, Trajectory) else Trajectory.read(given)  # type: ignore[arg-type]
