# SPDX-License-Identifier: BSD-3-Clause
"""Results: folders that map, fuse and Mapper have written."""
from __future__ import annotations

import csv
import functools
import json
import os
from io import open as open_text
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Dict, List, NamedTuple, Optional, Tuple

import numpy as np
import numpy.typing as npt

from . import _core
from ._cloud import Cloud
from ._core import Camera
from ._recording import Frame, Recording, open as open_recording
from ._trajectory import Trajectory
from ._values import PathLike, path_of


class Keyframes(NamedTuple):
    """All N keyframes by time, robot after robot.

    stamps          N, seconds
    poses           N x 4 x 4, world_from_camera, metres
    numbers         N, as in keyframes.csv and Landmarks; each robot has its own
    frames          N, numbers of their frames; -1: not known (no map.db)
    sigma_position  N, metres, relative to the first keyframe: root of the trace of the covariance; NaN: not known
    sigma_rotation  N, radians
    robots          N, names
    """

    stamps: npt.NDArray[np.float64]
    poses: npt.NDArray[np.float64]
    numbers: npt.NDArray[np.int32]
    frames: npt.NDArray[np.int64]
    sigma_position: npt.NDArray[np.float64]
    sigma_rotation: npt.NDArray[np.float64]
    robots: npt.NDArray[np.str_]


class Length(NamedTuple):
    """A length in metres; the true one, but for the scale, lies within +- `within` of it with a probability of 95 %."""

    metres: float
    within: float


class Landmarks(NamedTuple):
    """Points of the sparse map, and M observations of them: their tracks.

    points     N x 3, metres, in the frame of the result
    point      M, index into `points`
    keyframe   M, number of the keyframe that saw it (Keyframes.numbers)
    frame      M, that keyframe's frame
    pixel      M x 2, position in the rectified image; (0, 0) is the centre of the first pixel
    robot      M, name of the robot whose keyframe it is
    """

    points: npt.NDArray[np.float64]
    point: npt.NDArray[np.int32]
    keyframe: npt.NDArray[np.int32]
    frame: npt.NDArray[np.int64]
    pixel: npt.NDArray[np.float32]
    robot: npt.NDArray[np.str_]


def _matrices(*columns: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """N x 4 x 4 of positions and unit quaternions: tx, ty, tz, qx, qy, qz, qw, each N."""
    tx, ty, tz, x, y, z, w = columns
    zero, one = np.zeros_like(tx), np.ones_like(tx)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), tx],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), ty],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), tz],
        [zero, zero, zero, one],
    ]
    return np.moveaxis(np.array(rows), 2, 0).copy()


def _name(field: str) -> str:
    """The text of a field of our tables: names that a spreadsheet would take for a formula have an apostrophe in front."""
    return field[1:] if field.startswith("'") else field


class Localization:
    """Where a recording's camera was in a map: the folder that `localize` has written."""

    def __init__(self, folder: PathLike) -> None:
        self.folder = Path(path_of(folder, "folder"))
        self.summary: Dict[str, Any] = dict(json.loads(_core.read_json(self.folder / "summary.json")))
        if "localized" not in self.summary:
            raise _core.InputError(f"{self.folder}: is no result of localize")
        with open_text(self.folder / "frames.csv", encoding="utf-8", newline="") as file:
            self._rows = list(csv.DictReader(file))

    def __repr__(self) -> str:
        return f"<plumbline.Localization {self.folder}>"

    @functools.cached_property
    def trajectory(self) -> Trajectory:
        """Poses of the located frames in the frame of the map's results."""
        return Trajectory.read(self.folder / "trajectory.txt")

    @property
    def located(self) -> npt.NDArray[np.bool_]:
        """N, one for each frame of the recording."""
        return np.array([row["state"] == "located" for row in self._rows], dtype=np.bool_)

    @property
    def sigma_position(self) -> npt.NDArray[np.float64]:
        """N, metres, root of the trace of the covariance relative to the map around the camera; NaN: not located."""
        return np.array([float(row["sigma_position"] or "nan") for row in self._rows], dtype=np.float64)

    @property
    def reasons(self) -> List[str]:
        """N, why each frame was not located; "": it was."""
        return [_name(row["reason"]) for row in self._rows]

    @property
    def reason(self) -> str:
        """Why all of it must not be trusted: less than half of the frames were located; "": it may be."""
        return str(self.summary.get("reason", ""))


class Result:
    """A result folder. Each part is read when it is first used.

    All positions are metres in one frame: z up, 0 on the floor, x along the walls, if these were found.
    """

    def __init__(self, folder: PathLike, _kept: Optional["TemporaryDirectory[str]"] = None) -> None:
        self.folder = Path(path_of(folder, "folder"))
        self._recordings: Dict[str, Recording] = {}
        self._kept = _kept  # a Mapper's own folder lives as long as its result
        self._robot_folders  # raises InputError: not a result

    def __repr__(self) -> str:
        return f"<plumbline.Result {self.folder}>"

    @functools.cached_property
    def summary(self) -> Dict[str, Any]:
        """summary.json: counts, times, memory, evidence."""
        return dict(json.loads(_core.read_json(self.folder / "summary.json")))

    @property
    def reason(self) -> str:
        """Why the result must not be trusted; "": it may be."""
        return str(self.summary.get("reason", ""))

    @property
    def trustworthy(self) -> bool:
        return self.reason == ""

    @functools.cached_property
    def trajectory(self) -> Trajectory:
        """Tracked poses of a single robot, with their covariance. Raises InputError for several robots: see `robots`."""
        if len(self._robot_folders) > 1:
            names = ", ".join(folder.name for folder in self._robot_folders)
            raise _core.InputError(f"{self.folder}: has the paths of several robots ({names}); they are in .robots")
        return self._path(self._robot_folders[0])

    @functools.cached_property
    def robots(self) -> Dict[str, Trajectory]:
        """The path of each robot, by name; a single robot has the name "". """
        if self._robot_folders == [self.folder]:
            return {"": self.trajectory}
        return {folder.name: self._path(folder) for folder in self._robot_folders}

    @functools.cached_property
    def _robot_folders(self) -> List[Path]:
        return _core.robot_folders(self.folder)

    def _path(self, folder: Path) -> Trajectory:
        path = Trajectory.read(folder / "trajectory.txt")
        robot = "" if folder == self.folder else folder.name
        if (self.folder / "map.db").exists():
            path._kept = (self.folder, robot)
        return path

    @functools.cached_property
    def cloud(self) -> Cloud:
        """The merged cloud, map.ply or map.pcd."""
        ply = self.folder / "map.ply"
        return Cloud.read(ply if ply.exists() else self.folder / "map.pcd")

    @functools.cached_property
    def keyframes(self) -> Keyframes:
        file = self.folder / "keyframes.csv"
        try:
            # Earlier versions wrote names as they were.
            with open(file, encoding="utf-8", errors="replace", newline="") as table:
                rows = list(csv.DictReader(table))
            return self._keyframes_of(rows)
        except OSError as problem:
            raise _core.InputError(f"{file}: cannot be read: {problem.strerror}") from problem
        except (csv.Error, KeyError, TypeError, ValueError) as problem:
            raise _core.InputError(f"{file}: is damaged: a row does not fit the columns; map again") from problem

    def _keyframes_of(self, rows: List[Dict[str, str]]) -> Keyframes:
        known: Dict[Tuple[str, int], int] = {}
        if (self.folder / "map.db").exists():
            known = _core.keyframe_frames(self.folder)

        def column(name: str) -> npt.NDArray[np.float64]:
            return np.array([float(row[name]) if row[name] else np.nan for row in rows], np.float64)

        poses = _matrices(*(column(name) for name in ("tx", "ty", "tz", "qx", "qy", "qz", "qw")))
        names = [(_name(row["robot"]), int(row["keyframe"])) for row in rows]
        return Keyframes(
            column("stamp"), poses, np.array([number for _, number in names], np.int32),
            np.array([known.get(name, -1) for name in names], np.int64),
            column("sigma_position"), column("sigma_rotation"), np.array([robot for robot, _ in names], np.str_),
        )

    @functools.cached_property
    def pose_samples(self) -> npt.NDArray[np.float32]:
        """N x 32 x 6, one row for each of `keyframes`: 32 errors that the poses may have, drawn together. Each is a shift
        (metres) and a turn (radians) in the camera's axes. Raises InputError: the path was not checked."""
        file = self.folder / "pose_samples.npy"
        try:
            records: npt.NDArray[Any] = np.load(file)
        except (OSError, ValueError) as problem:
            raise _core.InputError(f"{file}: cannot be read: {problem}; results whose path was checked have it") from problem
        return np.asarray(records["motion"], np.float32)

    def length(self, points: npt.ArrayLike, seen: Optional[npt.ArrayLike] = None, sigma: npt.ArrayLike = 0.0) -> Length:
        """Length of the line through P x 3 points of the map, with its 95 %: what errors of the poses and of the points can change.

        seen: rows of `keyframes` by which each point was measured; None: of those that have it in view the nearest.
        sigma: standard deviation of each point's own place, metres, such as the cloud's column "sigma".
        """
        p = np.asarray(points, np.float64).reshape(-1, 3)
        rows = np.array([self._nearest_view(q) for q in p], np.int64) if seen is None else np.asarray(seen, np.int64)
        turn = self.keyframes.poses[rows, :3, :3]
        arm = np.einsum("nji,nj->ni", turn, p - self.keyframes.poses[rows, :3, 3])
        motion = self.pose_samples[rows].astype(np.float64)
        shift = motion[..., :3] + np.cross(motion[..., 3:], arm[:, np.newaxis])
        moved = p[:, np.newaxis] + np.einsum("nij,nsj->nsi", turn, shift)

        metres = float(np.linalg.norm(np.diff(p, axis=0), axis=-1).sum())
        drawn = np.linalg.norm(np.diff(moved, axis=0), axis=-1).sum(axis=0)
        own = np.sum(np.broadcast_to(np.asarray(sigma, np.float64), len(p)) ** 2)
        return Length(metres, float(2.04 * np.sqrt(np.mean((drawn - metres) ** 2) + own)))  # Student's, of 32 draws

    def _nearest_view(self, point: npt.NDArray[np.float64]) -> int:
        """Row of the keyframe nearest to a point among those that have it in view, else of the nearest one."""
        poses, camera = self.keyframes.poses, self.camera
        local = np.einsum("nji,nj->ni", poses[:, :3, :3], point - poses[:, :3, 3])
        z = np.maximum(local[:, 2], 1e-6)
        u, v = camera.fx * local[:, 0] / z + camera.cx, camera.fy * local[:, 1] / z + camera.cy
        inside = (local[:, 2] > 0.1) & (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
        distance = np.linalg.norm(local, axis=1)
        return int(np.argmin(np.where(inside | ~inside.any(), distance, np.inf)))

    @functools.cached_property
    def lines(self) -> npt.NDArray[np.float64]:
        """N x 2 x 3: both ends of each 3D line."""
        return _core.read_lines(self.folder / "lines.ply")

    @functools.cached_property
    def landmarks(self) -> Landmarks:
        """Points of the map. Raises InputError if the result has no map.db (store.enabled=off)."""
        points, point, keyframe, frame, pixel, robots, names = _core.read_landmarks(self.folder)
        robot = np.array([names[number] for number in robots], np.str_)
        return Landmarks(points, point, keyframe, frame, pixel, robot)

    @functools.cached_property
    def camera(self) -> Camera:
        """The camera that was used: as given, or as the run refined it; of several robots the first one's."""
        folder = self._robot_folders[0]
        file = folder / "camera.yaml"
        return Camera.from_yaml((file if file.exists() else self.folder / "camera.yaml").read_text(encoding="utf-8"))

    @property
    def camera_findings(self) -> Dict[str, Dict[str, Any]]:
        """What is known of each robot's camera, by robot: numbers with their sigma, as summary.json has it."""
        return {str(entry["robot"]): entry for entry in self.summary.get("camera", [])}

    @property
    def camera_pairs(self) -> List[Dict[str, Any]]:
        """Of each two robots whether their cameras may be one: `a`, `b`, `agree`, `chi2`, `sigmas`, `number`, `text`."""
        return list(self.summary.get("camera_pairs", []))

    def image(self, frame: int, robot: str = "") -> Frame:
        """A frame of the mapped recording, by its number in Keyframes and Landmarks; `robot`: one of several.

        Raises InputError if the recording is no longer at its place, if the result was fused from other maps or its
        frames were fed, or if `robot` is none of several.
        """
        return self._recording(robot)[frame]

    def _recording(self, robot: str) -> Recording:
        if robot in self._recordings:
            return self._recordings[robot]

        known = [folder.name for folder in self._robot_folders]
        if len(known) > 1 and robot not in known:
            raise _core.InputError(f"{self.folder}: no robot {robot!r}; give one of them: {', '.join(known)}")

        if not robot and len(known) == 1 and self._robot_folders[0] != self.folder:
            robot = known[0]  # of several, the one that is in the map
        names = [str(entry["name"]) for entry in self.summary.get("robots", [])]
        number = names.index(robot) + 1 if robot in names else 1
        run = _core.run_settings(self.folder / "config.yaml")
        recording = run.get("input" if number == 1 else f"input{number}", "")
        if "fed" in run:
            raise _core.InputError(f"{self.folder}: was made of frames that were fed; there is no recording of them")
        if not recording:
            raise _core.InputError(f"{self.folder}: does not say which recording it was made from; open that one instead")

        here = self.folder / run.get("folder", "") / recording
        recording = os.fspath(here) if here.exists() else recording
        topics = {key[len("topic_"):]: value for key, value in run.items() if key.startswith("topic_")}
        self._recordings[robot] = open_recording(
            recording, camera=run["camera"], format=run["format"], start=_seconds(run["from"]),
            end=_seconds(run["to"]) if "to" in run else None, every=int(run["every"]), topics=topics,
        )
        return self._recordings[robot]


def _seconds(text: str) -> float:
    """Seconds of a time as config.yaml has it: "2.5 s"."""
    return float(text.split()[0])


def load(folder: PathLike) -> Result:
    """Opens the result folder of an earlier run. Raises InputError: there is none."""
    return Result(folder)
