# SPDX-License-Identifier: BSD-3-Clause
"""Python values as pipeline files spell them."""
from __future__ import annotations

import json
import logging
import os
from typing import Any, Dict, Iterable, List, Mapping, Tuple, Union

from . import _core

PathLike = Union[str, "os.PathLike[str]"]
log = logging.getLogger("plumbline")


def path_of(given: PathLike, argument: str) -> str:
    """The path as text. Raises ConfigError if it is empty: mostly a variable that was not set."""
    path = os.fspath(given)
    if not path:
        raise _core.ConfigError(f"{argument}: is empty; give a path")
    return path


def text_of(value: Any) -> str:
    """A value as YAML of one line: True is on, lists and dicts are written in brackets, text stays as it is."""
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, str):
        return value
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {nested(item)}" for key, item in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(nested(item) for item in value) + "]"
    if hasattr(value, "__fspath__"):
        return str(os.fspath(value))
    return str(value)


def nested(value: Any) -> str:
    """The same inside brackets, where text with special characters is quoted."""
    if isinstance(value, str) and (not value or any(sign in value for sign in ",:[]{}#\"'")):
        return json.dumps(value)
    return text_of(value)


def overrides(options: Mapping[str, Any]) -> List[str]:
    """`track={"loops": False}` and `**{"track.loops": False}` as "track.loops=off"."""
    settings = []
    for name, value in options.items():
        if isinstance(value, Mapping) and "." not in name:
            settings += [f"{name}.{key}={text_of(item)}" for key, item in value.items()]
        else:
            settings.append(f"{name}={text_of(value)}")
    return settings


def option_texts(options: Mapping[str, Any]) -> Dict[str, str]:
    return {key: text_of(value) for key, value in options.items()}


def tell(messages: Iterable[Tuple[str, str]]) -> None:
    """Passes the messages of a run to the logger "plumbline"."""
    for level, message in messages:
        log.log(getattr(logging, level), "%s", message)
