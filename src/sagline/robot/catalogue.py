"""The presets: robot files that come with sagline."""

from __future__ import annotations

from importlib.resources import files

from sagline.core.errors import InvalidValueError, nearest

_PRESETS = files("sagline.robot") / "presets"


def robot_names() -> tuple[str, ...]:
    """Names of the presets.

    Returns:
        In alphabetical order.

    Examples:
        >>> import sagline as sl
        >>> sl.robot_names()[:3]
        ('article-mixed', 'article-prototype', 'article-suspended')
    """
    return tuple(
        sorted(entry.name.removesuffix(".yaml") for entry in _PRESETS.iterdir() if entry.name.endswith(".yaml"))
    )


def preset_text(name: str) -> str:
    """Text of a preset's robot file."""
    names = robot_names()
    if name not in names:
        near = nearest(name, names)
        hint = f"Did you mean {near}? " if near else ""
        raise InvalidValueError(
            "robot", repr(name), ", ".join(names), f"{hint}A robot file is given by its path, robot.yaml."
        )
    return (_PRESETS / f"{name}.yaml").read_text(encoding="utf-8")
