"""The scene: differences from the default one."""

from __future__ import annotations

import json
from os import PathLike, fspath
from typing import Any, Mapping, Union, cast

from . import _touchup
from ._arrays import error
from ._scene_keys import Scene

SceneLike = Union[Scene, Mapping[str, Any], str, "PathLike[str]", None]
"""A `Scene`, or a dictionary like it; or the path of a YAML file; None: the default scene."""


def default_scene() -> Scene:
    """The default scene: each key with its default, without the parts that are off and the numbers that have none.

    A scene names differences only, so there is no need to start from this one.
    """
    return cast(Scene, json.loads(_touchup.default_scene()))


def check_scene(scene: SceneLike) -> None:
    """Refuses a scene with an unknown key, a number out of its range, or without the radius of the ball.

    Raises `TouchupError`.
    """
    _touchup.check_scene(*given(scene))


def given(scene: SceneLike) -> tuple[str | None, str | None]:
    """Its text, or its path."""
    if scene is None:
        return "{}", None
    if isinstance(scene, (str, PathLike)):
        return None, fspath(scene)
    if not isinstance(scene, Mapping):
        raise error(f"a scene is a dictionary or the path of a file; a {type(scene).__name__} is neither")
    # the text is YAML, as is JSON; parts that are off are words
    return json.dumps({part: "off" if keys is False else _plain(keys) for part, keys in scene.items()}), None


def _plain(value: Any) -> Any:
    """With numbers and lists in place of those of NumPy."""
    if isinstance(value, Mapping):
        return {key: _plain(of) for key, of in value.items()}
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, PathLike):
        return fspath(value)
    return [_plain(of) for of in value] if isinstance(value, (list, tuple)) else value
