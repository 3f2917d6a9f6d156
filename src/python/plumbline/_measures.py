# SPDX-License-Identifier: BSD-3-Clause
"""Numbers, exports and pictures of results."""
from __future__ import annotations

import csv
import functools
import json
import os
from io import open as open_text
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Dict, List, Optional, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _core
from ._cloud import Cloud, CloudLike, cloud_of
from ._result import Result
from ._trajectory import TrajectoryLike, trajectory_of
from ._values import PathLike, option_texts, path_of, tell

MapLike = Union[Result, PathLike]


def _path(given: MapLike) -> str:
    return os.fspath(given.folder) if isinstance(given, Result) else path_of(given, "map")


class Report(Dict[str, Any]):
    """Numbers as `plumbline evaluate --json` prints them, with arrays of their own.

    stamps  of evaluate_trajectory: N, seconds, of the poses that have truth
    errors  N, metres: of each such pose, or of each point of a cloud (NaN: not measured); empty without a reference
    """

    stamps: npt.NDArray[np.float64]
    errors: npt.NDArray[Any]


def evaluate_trajectory(
    estimate: Union[TrajectoryLike, Result], truth: Union[TrajectoryLike, Result], **options: Any
) -> Report:
    """Absolute and relative pose error (ATE, RPE): `report["ate_m"]["rmse"]` and so on.

    estimate, truth  a Trajectory, a Result, a file, a result folder; truth also a recording's folder with groundtruth.txt
    options          align ("se3", "sim3", "start", "none"), body ("fit"), max_dt ... as plumbline evaluate trajectory --help lists them

    Raises InputError (no overlap in time, fewer than 3 poses), ConfigError.
    """
    if isinstance(truth, (str, os.PathLike)) and path_of(truth, "truth") and (Path(truth) / "groundtruth.txt").exists():
        truth = Path(truth) / "groundtruth.txt"
    path, true_path = trajectory_of(estimate), trajectory_of(truth)
    text, stamps, errors = _core.evaluate_trajectory(
        path.stamps, path.poses, true_path.stamps, true_path.poses, option_texts(options)
    )
    report = Report(json.loads(text))
    report.stamps, report.errors = stamps, errors
    return report


class Changes:
    """What has changed between two maps: the folder that `compare` has written.

    changes  rows of changes.csv: numbers where they are numbers; None: empty
    """

    def __init__(self, folder: PathLike) -> None:
        self.folder = Path(path_of(folder, "folder"))
        self.summary: Dict[str, Any] = dict(json.loads(_core.read_json(self.folder / "summary.json")))
        with open_text(self.folder / "changes.csv", encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        self.changes: List[Dict[str, Any]] = [
            {key: text if key == "kind" else float(text) if text else None for key, text in row.items()} for row in rows
        ]

    @functools.cached_property
    def cloud(self) -> Cloud:
        """The places that were compared, with columns kind, distance, limit and so on."""
        return Cloud.read(self.folder / "changes.ply")

    def __repr__(self) -> str:
        return f"<plumbline.Changes {self.folder}: {len(self.changes)}>"


def compare(
    before: MapLike, after: MapLike, output: PathLike, *, order: str = "stamps", threads: int = 0, force: bool = False,
    **options: Any,
) -> Changes:
    """Tells what has changed between two maps of one place: `plumbline compare` as a call.

    order    "stamps" or "given": which map is the later one
    options  spacing, depth, min_size ... as plumbline compare --help lists them

    Raises UntrustworthyError (they do not fit together), InputError, ConfigError, OutputError.
    """
    if order not in ("stamps", "given"):
        raise _core.ConfigError(f"order: '{order}' (allowed: stamps, given)")
    _core.compare(
        _path(before), _path(after), path_of(output, "output"), order == "given", option_texts(options), force, threads
    )
    return Changes(output)


def evaluate_cloud(
    cloud: Union[CloudLike, Result],
    reference: PathLike = "",
    *,
    paths: Optional[List[Tuple[PathLike, PathLike]]] = None,
    threads: int = 0,
    **options: Any,
) -> Report:
    """Accuracy, completeness and wall thickness: `report["accuracy_mm"]["rmse"]` and so on.

    reference  the true surface (PLY: mesh or samples), or a folder with reference.ply; "": measures of the cloud itself
    paths      (estimated, true) trajectory files, where the alignment starts
    options    align ("none", "se3"), distance ... as plumbline evaluate cloud --help lists them
    """
    measured = cloud_of(cloud)
    surface = os.fspath(reference)
    if os.path.isdir(surface):
        surface = os.path.join(surface, "reference.ply")
    pairs = [(path_of(a, "paths"), path_of(b, "paths")) for a, b in paths or []]
    text, errors = _core.evaluate_cloud(
        measured.points, measured.shift.tolist(), measured.normals, surface, pairs, option_texts(options), threads
    )
    report = Report(json.loads(text))
    report.stamps, report.errors = np.empty(0), errors
    return report


def export(
    map: MapLike,  # noqa: A002
    output: PathLike,
    *,
    format: str = "",  # noqa: A002
    what: str = "cloud",
    force: bool = False,
    threads: int = 0,
    **options: Any,
) -> List[Path]:
    """Writes a map in the form of another program; returns the files.

    format   "nav2", "colmap", "las" ... as plumbline export --help lists them; "": by the output's ending
    what     "cloud", "mesh", "trajectory", "keyframes" or "lines"
    options  of the format: voxel="1 cm", resolution="5 cm", box=[0, 0, 0, 2, 2, 2] ...
    """
    written, notes = _core.write_export(
        _path(map), path_of(output, "output"), format, what, option_texts(options), force, threads
    )
    tell(("INFO", note) for note in notes)
    return [Path(file) for file in written]


def render(
    map: Union[MapLike, Cloud],  # noqa: A002
    view: str = "iso",
    *,
    size: Tuple[int, int] = (1600, 1200),
    color: str = "rgb",
    title: str = "",
    lines: bool = False,
    file: Optional[PathLike] = None,
    **options: Any,
) -> npt.NDArray[np.uint8]:
    """A picture of a map or cloud, without a display: height x width x 3, uint8, red first.

    view     "iso", "top", "bottom", "front", "back", "left", "right" or "explicit"
    size     width, height
    color    "rgb", "height" or "normal"
    file     also write it here, as PNG
    options  as plumbline render --help lists them: point_size, eye, target ...
    """
    with TemporaryDirectory(prefix="plumbline-") as folder:
        if isinstance(map, Cloud):
            source = os.path.join(folder, "cloud.ply")
            map.write(source)
        else:
            source = _path(map)
        picture = os.path.join(folder, "picture.png") if file is None else path_of(file, "file")
        texts = option_texts(dict(options, view=view, color=color, width=size[0], height=size[1]))
        image = _core.render(source, title or Path(source).stem, lines, texts, picture)
    return np.ascontiguousarray(image[:, :, 2::-1])
