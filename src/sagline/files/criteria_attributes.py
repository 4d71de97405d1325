"""Criteria of a workspace as attributes of a data set, and what stands around as variables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sagline.cables.models import MODELS
from sagline.files.plan_file import choice_attributes, choice_of
from sagline.files.workspace_layout import CRITERIA
from sagline.interference.mesh import Mesh
from sagline.interference.obstacles import Box, Capsule, Sphere
from sagline.workspaces.criteria.clearance import Clearance
from sagline.workspaces.criteria.criterion import Criterion
from sagline.workspaces.criteria.position_error import PositionError

if TYPE_CHECKING:
    from xarray import Dataset

KINDS: Final[dict[str, type[Any]]] = {kind.__name__: kind for kind in (Box, Capsule, Sphere, Mesh)}


def criteria_attributes(criteria: Sequence[Criterion]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Criteria as attributes, and the obstacles among them as variables.

    Args:
        criteria: The criteria.

    Returns:
        Attributes and variables.

    Raises:
        InvalidValueError: If one of them, or of its obstacles, is none of sagline's.
    """
    attributes: dict[str, Any] = {}
    variables: dict[str, Any] = {}
    for k, one in enumerate(criteria):
        key = f"criterion_{k}"
        attributes |= choice_attributes(key, one, CRITERIA)
        if isinstance(one, PositionError):
            del attributes[f"{key}_model"]
            attributes |= choice_attributes(f"{key}_of_model", one.model, MODELS)
        if isinstance(one, Clearance):
            obstacles: Any = one.obstacles  # a tuple, once they are checked
            attributes[f"{key}_obstacles"] = len(obstacles)
            for j, obstacle in enumerate(obstacles):
                own, parts = _obstacle(f"{key}_obstacle_{j}", obstacle)
                attributes |= own
                variables |= parts
    return attributes, variables


def criteria_of(path: Path, data: Dataset) -> tuple[Criterion, ...]:
    """What `criteria_attributes` wrote.

    Args:
        path: The file, for messages.
        data: The data set.

    Returns:
        The criteria, in their order.

    Raises:
        FileError: If one is of a kind that this sagline does not know.
    """
    found: list[Criterion] = []
    while (key := f"criterion_{len(found)}") in data.attrs:
        known: dict[str, Any] = {}
        if data.attrs[key] == PositionError.__name__:
            known["model"] = choice_of(path, data.attrs, f"{key}_of_model", MODELS)
        if data.attrs[key] == Clearance.__name__:
            count = int(data.attrs[f"{key}_obstacles"])
            known["obstacles"] = tuple(_obstacle_of(data, f"{key}_obstacle_{j}") for j in range(count))
        found.append(choice_of(path, data.attrs, key, CRITERIA, **known))
    return tuple(found)


def _obstacle(key: str, obstacle: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """One of them: texts and numbers as attributes, arrays as variables with dimensions of their own."""
    attributes: dict[str, Any] = {key: type(obstacle).__name__}
    variables: dict[str, Any] = {}
    for field in fields(obstacle):
        value = getattr(obstacle, field.name)
        if isinstance(value, np.ndarray):
            name = f"{key}_{field.name}"
            variables[name] = (tuple(f"{name}_{axis}" for axis in range(value.ndim)), value)
        else:
            attributes[f"{key}_{field.name}"] = value
    return attributes, variables


def _obstacle_of(data: Dataset, key: str) -> Any:
    kind = KINDS[data.attrs[key]]
    values = {}
    for field in fields(kind):
        name = f"{key}_{field.name}"
        values[field.name] = data[name].values if name in data.variables else data.attrs[name]
    return kind(**values)
