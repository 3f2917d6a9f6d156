# SPDX-License-Identifier: BSD-3-Clause
"""Finds the shipped pipelines, cameras, scenes and filter chains, starting from this file."""
from __future__ import annotations

import functools
from pathlib import Path

from . import _core


@functools.lru_cache(maxsize=None)
def pipelines() -> Path:
    """The folder of the shipped pipelines: share/plumbline/pipelines beside this module or above it, else the source's."""
    for folder in Path(__file__).resolve().parents:
        candidate = folder / "share" / "plumbline" / "pipelines"
        if candidate.is_dir():
            return candidate
    source = Path(_core.source_pipelines)
    if source.is_dir():
        return source
    raise _core.ConfigError(f"{Path(__file__).parent}: the shipped pipelines are not beside this module; reinstall it")
