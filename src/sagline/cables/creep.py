"""Creep: slow elongation of a cable under tension, in addition to its elastic elongation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import flag
from sagline.core.arrays import Array, broadcast_shape, checked, locked
from sagline.core.errors import InvalidValueError
from sagline.kernels.cable.batch import creep_strains

MOST_ELEMENTS = 2


@dataclass(frozen=True, slots=True, eq=False)
class Creep:
    """Creep strain of a cable: one or two Kelvin-Voigt elements (spring parallel to damper) in series with the cable.

    The elastic cable and one element form the standard linear solid. The elastic cable and two elements form the
    five-element model of polymer ropes. The creep is recoverable: without tension the strain returns to zero.

    Attributes:
        axial_stiffness: Stiffness k of each element [N], > 0, shape (1,) or (2,). Under a constant tension T, the
            strain of an element approaches T/k.
        time: Retardation time of each element [s], > 0, of the same shape. After this time, the strain of the element
            is 63 % (1 - 1/e) of T/k.

    Examples:
        Strain of a fiber rope under 1 kN after a second, a minute and an hour:

        >>> import sagline as sl
        >>> creep = sl.Creep(axial_stiffness=[1e6, 4e5], time=[30.0, 1200.0])
        >>> strain = creep.strain([0.0, 1.0, 60.0, 3600.0], [1000.0] * 4)
        >>> print((1e3 * strain).round(3), "mm/m")
        [0.    0.035 0.987 3.376] mm/m

    Source:
        Adv. Mech. Eng. 2017, doi 10.1177/1687814017737199 (five elements); exact step in docs/model.md, section 10.
    """

    axial_stiffness: Array
    time: Array

    def __init__(self, axial_stiffness: ArrayLike, time: ArrayLike) -> None:
        """Check the elements.

        Args:
            axial_stiffness: Stiffness of each element [N], > 0: a number, or a list of one or two numbers.
            time: Retardation time of each element [s], > 0: a number, or a list of one or two numbers.

        Raises:
            InvalidValueError: If a number is not positive, or there are more than two elements.
        """
        stiffness = checked(axial_stiffness, "axial_stiffness", "N", above=0.0)
        delay = checked(time, "time", "s", above=0.0)
        shape = broadcast_shape("axial_stiffness and time", (1,), stiffness.shape, delay.shape)
        if len(shape) > 1 or not 1 <= shape[0] <= MOST_ELEMENTS:
            raise InvalidValueError(
                "axial_stiffness and time", f"of shape {shape}", "shape (), (1,) or (2,)", "Give one or two elements."
            )
        for name, values in (("axial_stiffness", stiffness), ("time", delay)):
            object.__setattr__(self, name, locked(np.array(np.broadcast_to(values, shape))))

    def strain(self, time: ArrayLike, tension: ArrayLike, *, settled: bool = False) -> Array:
        """Creep strain for a time series of tensions. Creep increases an unstrained length L to L (1 + strain).

        The strain is exact for tensions that vary linearly between samples.

        Args:
            time: Times of the samples [s], increasing, shape (N,).
            tension: Tensions [N], shape (N,) or (N, m); NaN at a sample without a solution.
            settled: True if the first tension has acted for a long time; if False, the strain starts at zero.

        Returns:
            Strain, of the shape of `tension`; NaN where the tension is NaN.

        Raises:
            InvalidValueError: If the times do not increase, or the shapes do not fit.
        """
        clock = checked(time, "time", "s", shape=(None,))
        force = checked(tension, "tension", "N", missing=True)
        if clock.ndim != 1 or force.ndim not in (1, 2) or len(force) != len(clock):
            shapes = f"of shapes {clock.shape} and {force.shape}"
            raise InvalidValueError("time and tension", shapes, "(N,) and (N,) or (N, m)", "Give one row per sample.")
        if (late := np.diff(clock) <= 0.0).any():
            k = int(np.argmax(late)) + 1
            allowed = f"more than {clock[k - 1]:g} s"
            raise InvalidValueError(f"time[{k}]", f"{clock[k]:g} s", allowed, "Give the samples in order of time.")
        rows = force.reshape(len(clock), -1)
        found, state = np.empty(rows.shape), locked(np.array([flag(settled, "settled")], dtype=np.bool_))
        creep_strains(clock, rows, self.axial_stiffness, self.time, state, found)
        return locked(found.reshape(force.shape))

    def __reduce__(self) -> tuple[Any, tuple[Array, Array]]:
        """Pickle through the constructor."""
        return Creep, (self.axial_stiffness, self.time)
