"""Criteria of a workspace as attributes of a data set, and what stands around as variables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sagline.files.plan_file import MODELS, choice_attributes, choice_of
from sagline.files.workspace_layout import CRITERIA
from sagline.workspaces.criteria.criterion import Criterion
from sagline.workspaces.criteria.position_error import PositionError

if TYPE_CHECKING:
    from xarray import Dataset


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
        found.append(choice_of(path, data.attrs, key, CRITERIA, **known))
    return tuple(found)
