# SPDX-License-Identifier: BSD-3-Clause
"""Point clouds as arrays."""
from __future__ import annotations

import os
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _core
from ._values import PathLike, nested, path_of


class FilterReport(NamedTuple):
    """What one filter of a chain did; points are those with finite coordinates."""

    type: str
    points_in: int
    points_out: int


class Cloud:
    """A point cloud. Its arrays share its memory: nothing is copied, and writing to them changes the cloud.

    reports  what each filter did, if `filter` made the cloud
    """

    def __init__(self, core: _core.PointCloud, reports: Sequence[FilterReport] = ()) -> None:
        self._core = core
        self.reports: List[FilterReport] = list(reports)

    @classmethod
    def of(
        cls,
        points: npt.ArrayLike,
        *,
        colors: Optional[npt.ArrayLike] = None,
        normals: Optional[npt.ArrayLike] = None,
        columns: Optional[Mapping[str, npt.ArrayLike]] = None,
    ) -> "Cloud":
        """Makes a cloud from arrays: points N x 3 (metres), colors N x 3 (0-255, red first), normals N x 3, and one
        number per point in each column. Colors default to white, normals to NaN. Raises InputError for other shapes."""
        return cls(_core.PointCloud(
            np.asarray(points, np.float32),
            None if colors is None else np.asarray(colors, np.uint8),
            None if normals is None else np.asarray(normals, np.float32),
            dict(columns or {}),
        ))

    @classmethod
    def read(cls, file: PathLike) -> "Cloud":
        """Reads PLY, PCD, XYZ or CSV. Raises InputError."""
        return cls(_core.PointCloud.read(path_of(file, "file")))

    def write(self, file: PathLike) -> None:
        """Writes .ply or .pcd, binary, with all columns. Raises ConfigError (another ending), OutputError."""
        self._core.write(path_of(file, "file"))

    def to_ply(self, file: PathLike) -> None:
        """The same as write, for a name that ends in .ply."""
        self.write(file)

    def to_open3d(self) -> Any:
        """Returns an open3d.geometry.PointCloud with colours and normals (copies). Raises ImportError without Open3D."""
        import open3d  # type: ignore[import]

        cloud = open3d.geometry.PointCloud()
        cloud.points = open3d.utility.Vector3dVector(self.points.astype(np.float64))
        cloud.colors = open3d.utility.Vector3dVector(self.colors.astype(np.float64) / 255.0)
        if np.isfinite(self.normals).all():
            cloud.normals = open3d.utility.Vector3dVector(self.normals.astype(np.float64))
        return cloud

    def __len__(self) -> int:
        return len(self._core)

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        """A column by its name: "confidence", "observations" ..., or a field of `array`."""
        columns = self.columns
        return columns[name] if name in columns else self.array[name]

    def __repr__(self) -> str:
        return f"<plumbline.Cloud: {len(self)} points, columns {sorted(self.columns)}>"

    @property
    def points(self) -> npt.NDArray[np.float32]:
        """N x 3, metres. For files with large coordinates, add `shift`."""
        return self._core.points

    @property
    def normals(self) -> npt.NDArray[np.float32]:
        """N x 3, unit, towards the camera that saw the point; NaN: unknown."""
        return self._core.normals

    @property
    def colors(self) -> npt.NDArray[np.uint8]:
        """N x 3, 0-255, red first."""
        return self._core.colors

    @property
    def array(self) -> npt.NDArray[Any]:
        """Structured: fields x y z nx ny nz (float32) r g b (uint8)."""
        return self._core.array

    @property
    def columns(self) -> Dict[str, npt.NDArray[Any]]:
        """One number per point in each, by name: confidence (0-1), observations, robot, sigma (m), and others."""
        return self._core.columns

    @property
    def shift(self) -> npt.NDArray[np.float64]:
        """3, metres: subtracted from large coordinates when reading, added again when writing."""
        return self._core.shift


CloudLike = Union[Cloud, PathLike]


def cloud_of(given: object) -> Cloud:
    """A Cloud, a Result, or a file."""
    if isinstance(given, Cloud):
        return given
    own = getattr(given, "cloud", None)
    if isinstance(own, Cloud):
        return own
    path = path_of(given, "cloud")  # type: ignore[arg-type]
    return Cloud.read(os.path.join(path, "map.ply") if os.path.isdir(path) else path)


def filter(  # noqa: A001, the program's name for it
    cloud: CloudLike, chain: Union[str, Sequence[Mapping[str, Any]]], *, threads: int = 0
) -> Cloud:
    """The cloud after a chain of filters.

    chain  a shipped name ("map"), a file, or the filters themselves:
           [{"type": "voxel_grid", "leaf": "2 cm"}, {"type": "statistical_outlier"}]

    Raises ConfigError with every mistake of the chain. What each filter did is in `.reports`.
    """
    if isinstance(chain, str) or hasattr(chain, "__fspath__"):
        text = path_of(chain, "chain")
    else:
        text = nested(list(chain))
    result, reports = cloud_of(cloud)._core.filter(text, threads)
    return Cloud(result, [FilterReport(*report) for report in reports])
