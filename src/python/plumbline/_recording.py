# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of every layout and bag that the program reads."""
from __future__ import annotations

import os
import warnings
from dataclasses import dataclass
from typing import Iterator, Mapping, Optional, TypeVar, Union

import numpy as np
import numpy.typing as npt

from . import _core
from ._core import Camera
from ._trajectory import Trajectory
from ._values import PathLike, path_of, tell


def camera(name_or_file: PathLike) -> Camera:
    """A shipped calibration ("tum_fr1") or a camera file of any program that plumbline knows.

    Raises ConfigError: no such camera, or not one, with the place in the file.
    """
    return Camera._find(path_of(name_or_file, "name_or_file"))


Options = TypeVar("Options", bound=_core.RecordingOptions)


def reading(
    options: Options, camera: PathLike, format: str, start: float, end: Optional[float], every: int,  # noqa: A002
    poses: str, topics: Optional[Mapping[str, str]],
) -> Options:
    """`options` with the arguments that all calls share which read a recording."""
    options.camera, options.format, options.every = os.fspath(camera), format, every
    options.from_s, options.to_s, options.poses, options.topics = start, end, poses, dict(topics or {})
    return options


@dataclass(frozen=True)
class Frame:
    """One RGB-D pair. The arrays are not copied; keep them as long as you like.

    index        number within the recording
    stamp        time of color, seconds
    depth_stamp  time of depth, seconds
    color        height x width x 3, uint8, blue first, as OpenCV has it
    depth        height x width: float32, metres along the optical axis, 0 = no measurement;
                 with raw=True: uint16 in units of 1 / camera.depth_scale m
    odometry     4 x 4, world_from_camera by the recorder's own odometry, metres; None: there is none
    camera       camera of both images, pixel for pixel (raw=True: before undistortion and registration)
    """

    index: int
    stamp: float
    depth_stamp: float
    color: npt.NDArray[np.uint8]
    depth: Union[npt.NDArray[np.float32], npt.NDArray[np.uint16]]
    odometry: Optional[npt.NDArray[np.float64]]
    camera: Camera


class Recording:
    """A recording, made by `open`: has `len`, frames by number, and iteration. Several threads may read frames."""

    def __init__(self, core: _core.Recording, raw: bool) -> None:
        self._core = core
        self._raw = raw
        self._camera = core.camera

    def __len__(self) -> int:
        return len(self._core)

    def __getitem__(self, index: int) -> Frame:
        """The frame of that number. Raises InputError if it cannot be read, IndexError if there is none."""
        if index < 0:
            index += len(self)
        if not 0 <= index < len(self):
            raise IndexError(f"{self.name}: frame {index} of {len(self)}")
        read = self._core.stored if self._raw else self._core.read
        number, stamp, depth_stamp, color, depth, odometry = read(index)
        return Frame(number, stamp, depth_stamp, color, depth, odometry, self._camera)

    def __iter__(self) -> Iterator[Frame]:
        """All frames in order. Those that cannot be read are skipped with a warning, as in the program."""
        for index in range(len(self)):
            try:
                frame = self[index]
            except _core.InputError as problem:
                if self._raw and "no stored images" in str(problem):
                    raise
                warnings.warn(f"frame {index} is skipped: {problem}", RuntimeWarning, stacklevel=2)
                continue
            yield frame

    def __repr__(self) -> str:
        return f"<plumbline.Recording {self.name}: {len(self)} frames, {self.format}>"

    @property
    def name(self) -> str:
        """Name of the folder or file."""
        return self._core.name

    @property
    def format(self) -> str:
        """The layout: "tum", "mcap", "synth" ..."""
        return self._core.format

    @property
    def camera(self) -> Camera:
        return self._camera

    @property
    def stamps(self) -> npt.NDArray[np.float64]:
        """Stamps of all frames, seconds."""
        return self._core.stamps

    @property
    def truth(self) -> Optional[Trajectory]:
        """The true path, if the recording has one."""
        arrays = self._core.truth
        return None if arrays is None else Trajectory(*arrays)


def open(  # noqa: A001, as in gzip.open
    input: PathLike,  # noqa: A002
    *,
    camera: PathLike = "",
    format: str = "auto",  # noqa: A002
    start: float = 0.0,
    end: Optional[float] = None,
    every: int = 1,
    raw: bool = False,
    poses: str = "prior",
    topics: Optional[Mapping[str, str]] = None,
    threads: int = 0,
) -> Recording:
    """Opens a folder, a ROS bag, a film or "synth:SCENE?frames=900".

    camera   shipped calibration or file; "": the recording's own
    format   layout; "auto": recognised
    start    seconds after the first frame
    end      seconds after the first frame; None: to the last one
    every    every n-th frame
    raw      frames as the camera took them, for Mapper.feed; else undistorted, with depth in metres and registered
    topics   of a bag: {"color": ..., "depth": ..., "info": ..., "depth_info": ...}
    threads  for generated worlds; 0: one per core

    Raises InputError (not there, not a recording), ConfigError (camera, format). Warnings go to the logger "plumbline".
    """
    options = reading(_core.RecordingOptions(), camera, format, start, end, every, poses, topics)
    core = _core.open(path_of(input, "input"), options, threads)
    tell(core.messages())
    return Recording(core, raw)
