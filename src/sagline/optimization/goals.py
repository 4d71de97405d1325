"""Goals of a design search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np

from sagline.core.arguments import brief, choice
from sagline.core.arrays import Array, number
from sagline.core.errors import InvalidValueError
from sagline.core.results import set_fields


class Measured(NamedTuple):
    """Quantities of N candidates at G poses, for S samples of anchor errors (1 without errors).

    Attributes:
        margin: Margin of the wrench set [N], shape (N, S, G); -inf if a pose is singular or a cable has no length.
        tension: Largest cable tension [N], shape (N, S, G), NaN without tensions; None if no goal needs it.
        sag: Largest cable sag [m], shape (N, S, G), NaN without tensions; None if no goal needs it.
        stiffness: Stiffness in the softest direction [N/m], shape (N, S, G), NaN without tensions, or None as above.
        cost: Cost of the cables, shape (N, S); None if no goal needs it.
    """

    margin: Array
    tension: Array | None = None
    sag: Array | None = None
    stiffness: Array | None = None
    cost: Array | None = None


class _Kind(NamedTuple):
    """A kind of goal.

    Attributes:
        unit: Unit of the goal; "" for a share or a currency.
        larger_is_better: True if it is maximized by default.
        needs: Field of `Measured` from which the goal is computed.
        over_poses: Function that computes the goal's value from this field, over the last axis.
        text: Description of the goal.
    """

    unit: str
    larger_is_better: bool
    needs: str
    over_poses: Callable[[Array], Array]
    text: str


def _share(margin: Array) -> Array:
    return np.asarray((margin >= 0.0).mean(axis=-1))


def _mean(margin: Array) -> Array:
    return np.asarray(margin.mean(axis=-1))


def _least(values: Array) -> Array:
    return np.asarray(np.nanmin(values, axis=-1, initial=np.inf))


def _largest(values: Array) -> Array:
    return np.asarray(np.nanmax(values, axis=-1, initial=-np.inf))


def heading(name: str, unit: str) -> str:
    """Name and unit of a column: "mean_margin [N]"."""
    return f"{name} [{unit}]" if unit else name


KINDS: Final = MappingProxyType(
    {
        "workspace_share": _Kind("", True, "margin", _share, "share of the poses with a nonnegative margin"),
        "mean_margin": _Kind("N", True, "margin", _mean, "mean margin of all poses"),
        "least_margin": _Kind("N", True, "margin", _least, "least margin of all poses"),
        "largest_tension": _Kind("N", False, "tension", _largest, "largest tension"),
        "largest_sag": _Kind("m", False, "sag", _largest, "largest sag"),
        "least_stiffness": _Kind("N/m", True, "stiffness", _least, "least stiffness against a force"),
        "cable_cost": _Kind("", False, "cost", lambda cost: cost, "cost of the cables"),
    }
)
AT_POSES: Final = ("tension", "sag", "stiffness")  # goals that require a tension distribution


@dataclass(frozen=True, slots=True)
class Goal:
    """A quantity to maximize or minimize.

    Tensions, sag and stiffness are for the platform's weight plus the middle of the wrench set, with the tension
    distribution `MinimumNorm`. They are evaluated at the feasible poses of the initial robot. A candidate for which one
    of these poses is infeasible is rejected.

    Attributes:
        kind: "workspace_share" (share of the poses with a nonnegative margin), "mean_margin" or "least_margin"
            [N], "largest_tension" [N], "largest_sag" [m], "least_stiffness" [N/m] (against a force in any direction) or
            "cable_cost" (catalogue cost of cables, each as long as its longest chord).
        maximize: True to maximize, False to minimize.
        weight: Weight relative to other goals, > 0.
        scale: Value by which the goal is divided, in its unit; None: the initial robot's value, or 1 if it is 0.
    """

    kind: str
    maximize: bool
    weight: float
    scale: float | None

    def __init__(
        self, kind: str, *, maximize: bool | None = None, weight: float = 1.0, scale: float | None = None
    ) -> None:
        """Check kind, direction, weight and scale.

        Args:
            kind: One of the seven kinds.
            maximize: True to maximize, False to minimize; None: the default of the kind.
            weight: Weight relative to other goals, > 0.
            scale: Value by which the goal is divided, > 0, or None.

        Raises:
            InvalidValueError: If the goal does not exist, or an argument is of the wrong kind.

        Examples:
            >>> import sagline as sl
            >>> print(sl.Goal("workspace_share").maximize, sl.Goal("cable_cost").maximize)
            True False
        """
        found = KINDS[choice(kind, "goal", KINDS)]
        if maximize is not None and not isinstance(maximize, bool | np.bool_):
            raise InvalidValueError("maximize", brief(maximize), "True, False or None", "Choose one of these goals.")
        set_fields(
            self,
            kind=str(kind),
            maximize=found.larger_is_better if maximize is None else bool(maximize),
            weight=number(weight, "weight", "", above=0.0),
            scale=None if scale is None else number(scale, "scale", found.unit, above=0.0),
        )

    @property
    def unit(self) -> str:
        """Unit of the goal's values."""
        return KINDS[self.kind].unit

    @property
    def needs(self) -> str:
        """Field of `Measured` from which the goal is computed."""
        return KINDS[self.kind].needs

    def values(self, measured: Measured, *, worst: bool) -> Array:
        """Value of the goal of each candidate.

        Args:
            measured: Quantities of the candidates.
            worst: True for the worst value of the samples of anchor errors, False for the mean value.

        Returns:
            Values in the unit of the goal, shape (N,).
        """
        samples = KINDS[self.kind].over_poses(getattr(measured, self.needs))
        if not worst:
            return np.asarray(samples.mean(axis=-1))
        return np.asarray(samples.min(axis=-1) if self.maximize else samples.max(axis=-1))
