"""Creep: how much longer a cable slowly becomes under tension, beside what its axial stiffness says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arrays import Array, broadcast_shape, checked, locked
from sagline.core.errors import InvalidValueError
from sagline.kernels.cable.batch import creep_strains

MOST_ELEMENTS = 2


@dataclass(frozen=True, slots=True, eq=False)
class Creep:
    """Late strain of a cable: one or two springs in series with it, each with a damper beside it.

    With the cable's axial stiffness, which acts at once, one element is the standard linear solid, two the five-element
    model of polymer ropes. It is recoverable: without tension the strain goes back.

    Attributes:
        axial_stiffness: Of each element [N], > 0, shape (1,) or (2,): under a tension T that stays, its strain becomes
            T over it.
        time: In which all but 1/e of that has come [s], > 0, of the same shape.

    Examples:
        A kilonewton on a fiber rope, after a second, a minute and an hour:

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
            axial_stiffness: Of each element [N], > 0: a number, or one or two in a list.
            time: Of each element [s], > 0, likewise.

        Raises:
            InvalidValueError: If one is not positive, or there are more than two.
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
        """Late strain along a course of tensions: unstrained lengths become L (1 + strain).

        Exact for tensions that change evenly from sample to sample.

        Args:
            time: Of the samples [s], rising, shape (N,).
            tension: [N], shape (N,) or (N, m); NaN at a sample without an answer.
            settled: Whether the first tension has acted for long; if not, the strain begins at zero.

        Returns:
            Strain, of the shape of tension; NaN where that is.

        Raises:
            InvalidValueError: If the times do not rise, or the shapes do not fit.
        """
        clock = checked(time, "time", "s", shape=(None,))
        force = checked(tension, "tension", "N", missing=True)
        if clock.ndim != 1 or force.ndim not in (1, 2) or len(force) != len(clock):
            shapes = f"of shapes {clock.shape} and {force.shape}"
            raise InvalidValueError("time and tension", shapes, "(N,) and (N,) or (N, m)", "Give a row a sample.")
        if (late := np.diff(clock) <= 0.0).any():
            k = int(np.argmax(late)) + 1
            allowed = f"more than {clock[k - 1]:g} s"
            raise InvalidValueError(f"time[{k}]", f"{clock[k]:g} s", allowed, "Give the samples in order of time.")
        if not isinstance(settled, bool | np.bool_):
            raise InvalidValueError("settled", repr(settled)[:40], "True or False", "Give one of the two.")
        rows = force.reshape(len(clock), -1)
        found = np.empty(rows.shape)
        creep_strains(clock, rows, self.axial_stiffness, self.time, locked(np.array([settled], dtype=np.bool_)), found)
        return locked(found.reshape(force.shape))

    def __reduce__(self) -> tuple[Any, tuple[Array, Array]]:
        """Pickle through the constructor."""
        return Creep, (self.axial_stiffness, self.time)
