# SPDX-License-Identifier: BSD-3-Clause
"""Mapping of recordings and of live frames; merging of maps."""
from __future__ import annotations

import os
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType
from typing import Any, Callable, List, Mapping, Optional, Sequence, Type, TypeVar, Union

import numpy as np
import numpy.typing as npt

from . import _core
from ._core import Camera
from ._recording import camera as find_camera, reading
from ._result import Localization, Result
from ._values import PathLike, overrides, path_of, tell

Progress = Callable[[int, int], None]
_Options = TypeVar("_Options", bound=_core.RunOptions)
_LOOK_UP = 0.05  # seconds between two checks for signals and messages


def _finish(run: Union[_core.Run, _core.MapperRun], progress: Optional[Progress] = None) -> None:
    """Waits for a run. After Ctrl-C the run first writes what it has; then KeyboardInterrupt is raised."""
    interrupted: Optional[KeyboardInterrupt] = None
    shown = (0, 0)
    while True:
        try:
            ended = run.wait(_LOOK_UP)
            tell(run.messages())
            if progress is not None and run.progress != shown:
                shown = run.progress
                progress(*shown)
            if ended:
                break
        except KeyboardInterrupt as pressed:
            if interrupted is not None:
                raise
            interrupted = pressed
            run.request_stop()
        except BaseException:
            run.request_stop()
            raise
    if interrupted is not None:
        raise interrupted
    reason = run.reason()
    if reason:
        tell([("WARNING", "the result is not trustworthy: " + reason)])


def _files(given: Union[PathLike, Sequence[PathLike]]) -> List[str]:
    if isinstance(given, (str, os.PathLike)):
        return [path_of(given, "recording")]
    if not given:
        raise _core.ConfigError("inputs: name a recording")
    return [path_of(one, "recording") for one in given]


def _running(options: _Options, pipeline: PathLike, given: Mapping[str, Any], threads: int, force: bool) -> _Options:
    """`options` with the arguments that all runs share."""
    options.pipeline, options.set = path_of(pipeline, "pipeline"), overrides(given)
    options.threads, options.replace = threads, force
    return options


def map(  # noqa: A001, the program's name for it
    recording: Union[PathLike, Sequence[PathLike]],
    output: PathLike,
    *,
    pipeline: PathLike = "rgbd",
    camera: PathLike = "",
    format: str = "auto",  # noqa: A002
    start: float = 0.0,
    end: Optional[float] = None,
    every: int = 1,
    poses: str = "prior",
    topics: Optional[Mapping[str, str]] = None,
    threads: int = 0,
    force: bool = False,
    resume: bool = False,
    into: Union[PathLike, Result, None] = None,
    rig: Optional[PathLike] = None,
    progress: Optional[Progress] = None,
    **options: Any,
) -> Result:
    """Maps a recording, or several, one per robot, into a result folder: `plumbline map` as a call.

    into      a finished map that this is another visit of, which stays as it is
    rig       rig.yaml: the recordings are of cameras that are fixed to each other on one robot
    progress  called with the number of frames that are done and of all frames, in this thread
    threads   0: one per core; results do not depend on it
    options   of stages: track={"loops": False} or **{"fuse.voxel": "2 cm"}

    The interpreter is free meanwhile: other threads run. Ctrl-C ends the run, which writes what it has; then
    KeyboardInterrupt is raised. Raises ConfigError, InputError, OutputError as the program's exit codes 2, 3, 5.
    """
    wanted = _running(_core.MapOptions(), pipeline, options, threads, force)
    files = _files(recording)
    wanted.others, wanted.resume = files[1:], resume
    if into is not None:
        wanted.into = os.fspath(into.folder) if isinstance(into, Result) else path_of(into, "into")
    if rig is not None:
        wanted.rig = path_of(rig, "rig")
    reading(wanted, camera, format, start, end, every, poses, topics)
    run = _core.start_map(files[0], path_of(output, "output"), wanted)
    _finish(run, progress)
    return Result(output)


def localize(
    map: Union[PathLike, Result],  # noqa: A002
    recording: PathLike,
    output: PathLike,
    *,
    pipeline: PathLike = "localize",
    camera: PathLike = "",
    format: str = "auto",  # noqa: A002
    start: float = 0.0,
    end: Optional[float] = None,
    every: int = 1,
    topics: Optional[Mapping[str, str]] = None,
    threads: int = 0,
    force: bool = False,
    progress: Optional[Progress] = None,
    **options: Any,
) -> Localization:
    """Finds a recording's camera in a finished map, which stays as it is: `plumbline localize` as a call.

    map  a result folder of `map` or `fuse`, its map.db, or a Result
    """
    known = os.fspath(map.folder) if isinstance(map, Result) else path_of(map, "map")
    wanted = _running(_core.MapOptions(), pipeline, options, threads, force)
    wanted.known_map = known
    reading(wanted, camera, format, start, end, every, "ignore", topics)
    run = _core.start_map(path_of(recording, "recording"), path_of(output, "output"), wanted)
    _finish(run, progress)
    return Localization(output)


def fuse(
    maps: Sequence[Union[PathLike, Result]],
    output: PathLike,
    *,
    anchor: str = "",
    rig: Optional[PathLike] = None,
    pipeline: PathLike = "fuse",
    threads: int = 0,
    force: bool = False,
    progress: Optional[Progress] = None,
    **options: Any,
) -> Result:
    """Merges finished maps of several robots into one frame: `plumbline fuse` as a call.

    anchor  robot whose map defines the frame; "": the one with the largest map
    rig     rig.yaml: the maps are of cameras that are fixed to each other on one robot
    """
    folders = [os.fspath(one.folder) if isinstance(one, Result) else path_of(one, "maps") for one in maps]
    wanted = _running(_core.FuseOptions(), pipeline, options, threads, force)
    wanted.anchor = anchor
    if rig is not None:
        wanted.rig = path_of(rig, "rig")
    run = _core.start_fuse(folders, path_of(output, "output"), wanted)
    _finish(run, progress)
    return Result(output)


def _sigma_of(rest: Sequence[Any]) -> float:
    """The standard deviation behind an observation, 5 mm if there is none."""
    if len(rest) > 1:
        raise ValueError(f"{len(rest)} values stand behind an observation; give its standard deviation alone")
    return float(rest[0]) if rest else 0.005


def adjust(
    map: Union[PathLike, Result],  # noqa: A002
    output: PathLike,
    *,
    lengths: Sequence[Sequence[Any]] = (),
    points: Sequence[Sequence[Any]] = (),
    epsg: int = 0,
    tags: PathLike = "",
    edits: PathLike = "",
    threads: int = 0,
    force: bool = False,
    progress: Optional[Progress] = None,
    **options: Any,
) -> Result:
    """Brings a finished map to scale and place by what was measured: `plumbline adjust` as a call.

    lengths  (p, q, metres[, sigma]): the distance of two places of the map's results
    points   (p, world[, sigma]): a place and its east, north, height, in the system `epsg` (0: the site's own grid)
    tags     tags.yaml; edits: edits.yaml
    """
    folder = os.fspath(map.folder) if isinstance(map, Result) else path_of(map, "map")
    wanted = _running(_core.FuseOptions(), "fuse", options, threads, force)
    taped = [(p, q, float(metres), _sigma_of(rest)) for p, q, metres, *rest in lengths]
    placed = [(p, world, _sigma_of(rest)) for p, world, *rest in points]
    run = _core.start_adjust(folder, path_of(output, "output"), taped, placed, epsg, os.fspath(tags), os.fspath(edits), wanted)
    _finish(run, progress)
    return Result(output)


class Tracked:
    """Result of a frame that was fed. All properties but `done` and `dropped` wait for the tracker."""

    def __init__(self, mapper: "Mapper", index: int, dropped: bool = False) -> None:
        self._mapper = mapper
        self.index = index
        self.dropped = dropped
        self._found: Optional[Any] = ("dropped", None, False) if dropped else None

    def _wait(self) -> Any:
        while self._found is None:
            self._found = self._mapper._pose(self.index)
        return self._found

    @property
    def done(self) -> bool:
        """True if the tracker has processed the frame; does not wait."""
        if self._found is None:
            self._found = self._mapper._run.pose(self.index, 0.0)
        return self._found is not None

    @property
    def state(self) -> str:
        """ "tracked", "lost", "initialising"; "dropped": it was left out."""
        return str(self._wait()[0])

    @property
    def pose(self) -> Optional[npt.NDArray[np.float64]]:
        """4 x 4, world_from_camera, metres, in the frame of the first camera; None: not tracked. The results of
        `finish` are optimised, and upright in a frame of their own."""
        pose: Optional[npt.NDArray[np.float64]] = self._wait()[1]
        return pose

    @property
    def keyframe(self) -> bool:
        return bool(self._wait()[2])

    def __repr__(self) -> str:
        return f"<plumbline.Tracked {self.index}: {self.state if self.done else 'under way'}>"


class Mapper:
    """Maps frames as they come, of a camera or of any other source:

        mapper = plumbline.Mapper(plumbline.camera("tum_fr3"))
        for color, depth, stamp in frames:
            print(mapper.feed(color, depth, stamp).pose)
        result = mapper.finish()

    camera     camera of the images: a Camera, a shipped name or a file
    pipeline   shipped name or file; with a track stage
    output     result folder; None: a temporary one, which lives as long as the result
    name       name of the robot in results
    queue      frames that may wait for the tracker; if it is full, `feed` waits, or with drop_late drops the frame
    drop_late  drop frames instead of waiting; `dropped` counts them
    threads    0: one per core
    options    options of stages: track={"loops": False} or **{"fuse.voxel": "2 cm"}

    Feed frames from one thread. As a context manager it cancels an unfinished run. After os.fork() use it only in the
    process that made it; better start processes with the method "spawn".
    """

    def __init__(
        self,
        camera: Union[Camera, PathLike],
        pipeline: PathLike = "rgbd",
        *,
        output: Optional[PathLike] = None,
        name: str = "live",
        queue: int = 16,
        drop_late: bool = False,
        threads: int = 0,
        force: bool = False,
        **options: Any,
    ) -> None:
        if queue < 1:
            raise _core.ConfigError(f"queue: {queue} is out of range (allowed: at least 1)")
        self._temporary = TemporaryDirectory(prefix="plumbline-") if output is None else None
        self._output = Path(self._temporary.name) / name if self._temporary else Path(path_of(output or "", "output"))
        self._drop_late = drop_late
        self._result: Optional[Result] = None
        self._process = os.getpid()
        self.dropped = 0
        self.fed = 0
        known = camera if isinstance(camera, Camera) else find_camera(camera)
        wanted = _running(_core.MapperOptions(), pipeline, options, threads, force)
        wanted.name, wanted.queue = name, queue
        self._run = _core.MapperRun(known, self._output, wanted)

    def feed(
        self,
        color: npt.NDArray[np.uint8],
        depth: Union[npt.NDArray[np.uint16], npt.NDArray[np.float32]],
        stamp: float,
        *,
        depth_stamp: Optional[float] = None,
        odometry: Optional[npt.NDArray[np.float64]] = None,
    ) -> Tracked:
        """Feeds a frame; the arrays are copied.

        color        height x width x 3, uint8, blue first, or height x width (grey); as the camera took it
        depth        height x width: uint16 in units of 1 / camera.depth_scale m, or float32 in metres (rounded to such
                     units); 0 or not finite: no measurement
        stamp        time of color, seconds, later than the one before
        depth_stamp  time of depth, seconds; None: the same
        odometry     4 x 4, world_from_camera by the source's own odometry, in a world of its own

        Raises InputError: another dtype, shape or size than the camera's, not contiguous, NaN everywhere, a stamp that is
        not later. The frame is then skipped, and others can be fed. Errors of the run itself are raised here, too.
        """
        if not isinstance(color, np.ndarray) or not isinstance(depth, np.ndarray) or np.ndim(stamp) > 0:
            kinds = ", ".join(type(given).__name__ for given in (color, depth, stamp))
            raise TypeError(f"feed(color, depth, stamp) takes two arrays and a number of seconds, not {kinds}")

        self._check()
        while not self._run.wait_for_room(0.0 if self._drop_late else _LOOK_UP):
            self._check()
            if self._drop_late:
                self.dropped += 1
                return Tracked(self, -1, dropped=True)
        index = self._run.push(stamp, depth_stamp, color, depth, odometry)
        self.fed += 1
        return Tracked(self, index)

    def finish(self, progress: Optional[Progress] = None) -> Result:
        """Ends feeding: refines the map, fuses the cloud, writes the results. A second call returns the same result.

        After Ctrl-C what there is is written before KeyboardInterrupt is raised. Raises as `map`.
        """
        if self._result is None:
            self._check_process()
            self._run.close()
            _finish(self._run, progress)
            self._result = Result(self._output, self._temporary)
        return self._result

    def cancel(self) -> None:
        """Cancels the run; nothing is written."""
        if self._result is None:
            self._run.abandon()
            self._run.request_stop()
            if self._temporary is not None and os.getpid() == self._process:
                while not self._run.wait(_LOOK_UP):
                    pass
                self._temporary.cleanup()

    @property
    def waiting(self) -> int:
        """Number of frames that were fed and not tracked yet."""
        return self._run.waiting

    def __enter__(self) -> "Mapper":
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.cancel()

    def _check_process(self) -> None:
        if os.getpid() != self._process:
            raise _core.ConfigError("this Mapper belongs to the process that made it; make one after the fork")

    def _check(self) -> None:
        self._check_process()
        if self._result is not None:
            raise _core.InputError("the mapper has finished and accepts no more frames")
        tell(self._run.messages())
        if self._run.done:
            self._run.reason()  # raises what ended it
            raise _core.InputError("the run has ended and accepts no more frames")

    def _pose(self, index: int) -> Optional[Any]:
        found = self._run.pose(index, _LOOK_UP)
        if found is None:
            if self._result is None:
                self._check()
            elif self._run.pose(index, 0.0) is None:
                raise _core.InputError(f"frame {index} was not tracked: the run ended before")
        return found
