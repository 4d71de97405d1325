"""Frame anchors that move: positions over time, of single anchors or of rigid bases that carry several anchors."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import numpy as np
from attrs import field, frozen
from numpy.typing import ArrayLike

from sagline.core.arguments import brief, elements, instance, whole_number
from sagline.core.arrays import Array, Indices, checked, locked
from sagline.core.errors import InvalidValueError
from sagline.core.fields import given, reduced
from sagline.core.results import Shown, set_fields
from sagline.motion.path import Path, checked_time
from sagline.robot.reach import ROUNDING
from sagline.robot.robot import Robot

_SAME: Final = 1e-9  # times outside the samples by less than this share of the duration count as inside
_STEP: Final = "Give samples of the anchors for the whole motion."


@frozen(eq=False, repr=False, weakref_slot=False)
class AnchorMotion(Shown):
    """Positions of all frame anchors over time, at K samples: anchors on ships, drones or vehicles.

    Between the samples, the positions are cubic splines of time (not-a-knot condition), with continuous velocities and
    accelerations. Two samples give constant velocities. For a sinusoidal motion, the interpolation errors are up to
    1e-4 of its amplitude with 20 samples per period, and up to 3e-6 with 40.

    Attributes:
        time: Time of each sample [s], shape (K,), K >= 2, strictly increasing.
        position: Positions of the frame anchors in the world [m], shape (K, m, 3).

    Raises:
        InvalidValueError: If the times do not increase, are fewer than two, or do not fit the positions. If a number is
            not finite.

    Examples:
        >>> import numpy as np
        >>> import sagline as sl
        >>> time = np.linspace(0.0, 10.0, 201)
        >>> heave = np.outer(0.5 * np.sin(0.6 * time), [0, 0, 1])
        >>> frame = sl.load_robot("cogiro").frame_anchors
        >>> anchors = sl.AnchorMotion(time, frame + heave[:, None])
        >>> print(anchors.at(2.5).shape, anchors.velocity(0.0)[0].round(3))
        (8, 3) [0.  0.  0.3]
    """

    time: Array = field(converter=given)
    position: Array = field(converter=given)

    def __attrs_post_init__(self) -> None:
        """Check the fields."""
        clock = checked_time(self.time)
        place = checked(self.position, "position", "m", shape=(None, None, 3))
        if clock.size < 2 or place.shape[0] != clock.size or place.ndim != 3 or not place.shape[1]:
            value = f"of shape {place.shape} with {clock.size} time{'s' * (clock.size != 1)}"
            allowed = "shape (K, m, 3) with K times, K >= 2"
            raise InvalidValueError("position", value, allowed, "Give the positions of all m anchors at each time.")
        set_fields(self, time=clock, position=place)

    def at(self, time: ArrayLike) -> Array:
        """Positions of the anchors at given times.

        Args:
            time: Times [s], shape (...), from the first to the last sample.

        Returns:
            Positions of the anchors [m], shape (..., m, 3).

        Raises:
            InvalidValueError: If a time is outside the samples.
        """
        return self._interpolated(self._checked(time), 0)

    def velocity(self, time: ArrayLike) -> Array:
        """Velocities of the anchors at given times.

        Args:
            time: Times [s], shape (...), from the first to the last sample.

        Returns:
            Velocities of the anchors [m/s], shape (..., m, 3).

        Raises:
            InvalidValueError: If a time is outside the samples.
        """
        return self._interpolated(self._checked(time), 1)

    def acceleration(self, time: ArrayLike) -> Array:
        """Accelerations of the anchors at given times.

        Args:
            time: Times [s], shape (...), from the first to the last sample.

        Returns:
            Accelerations of the anchors [m/s^2], shape (..., m, 3).

        Raises:
            InvalidValueError: If a time is outside the samples.
        """
        return self._interpolated(self._checked(time), 2)

    __reduce__ = reduced

    def _interpolated(self, time: Array, order: int) -> Array:
        """Derivative of the given order at any times; a little outside the samples, the end cubics continue."""
        from scipy.interpolate import CubicSpline  # slow import, only needed here

        return locked(CubicSpline(self.time, self.position, bc_type="not-a-knot")(time, order))

    def _checked(self, time: ArrayLike, item: str = "time") -> Array:
        """Times [s], refused if they are outside the samples."""
        asked = checked(time, item, "s")
        first, last = float(self.time[0]), float(self.time[-1])
        near = _SAME * (last - first)
        if ((asked < first - near) | (asked > last + near)).any():
            worst = float(asked.min() if asked.min() < first - near else asked.max())
            raise InvalidValueError(item, f"{worst:g} s", f"{first:g} s to {last:g} s, the samples of anchors", _STEP)
        return asked

    def _of(self, robot: Robot, time: ArrayLike) -> Array:
        """Positions (..., m, 3) at `time` of the anchors of `robot`, which must be able to have such anchors."""
        m, normal = self.position.shape[1], robot.plane_normal
        if m != robot.cable_count:
            step = "Give one position for each cable."
            raise InvalidValueError("anchors", f"of {m} cables", f"{robot.cable_count}, as {robot.name} has", step)
        if robot.winches is not None and robot.winches.guides is not None:
            step = "Use robot.replace(winches=robot.winches.replace(guides=None)) for a straight guided run."
            raise InvalidValueError("winches: guides", "given", "None with moving anchors", step)
        place = self._interpolated(self._checked(time, "anchors: time"), 0)
        if normal is not None and (away := np.abs((place - robot.frame_anchors) @ normal)).max() > ROUNDING:
            value, allowed = f"{away.max():.4g} m out of the plane", f"in the plane, by {robot.motion_pattern}"
            raise InvalidValueError("anchors", value, allowed, "Project the anchors onto the plane of the robot.")
        return place


def anchors_on_bases(robot: Robot, bases: Iterable[tuple[Path, Iterable[int]]]) -> AnchorMotion:
    """Motion of anchors that rigid bases carry, such as ships, drones or vehicles.

    The frame anchors of the robot are coordinates in the frame of their base. A base at the origin without rotation
    thus has its anchors where the robot file has them. Anchors of all other cables are fixed.

    Args:
        robot: The robot, with m cables.
        bases: One pair for each base: its path in the world, for example from `load_path`, and the indices of the
            cables whose anchors it carries. The result has the times of all bases at which all of them have samples or
            are between samples.

    Returns:
        Positions of all anchors.

    Raises:
        InvalidValueError: If a cable is on two bases or does not exist, or if the times of the bases do not overlap. If
            a base tilts and carries pulleys or dead lengths, because the swivel axes of pulleys stay vertical.

    Examples:
        >>> import numpy as np
        >>> import sagline as sl
        >>> robot, time = sl.load_robot("cogiro"), np.linspace(0.0, 10.0, 201)
        >>> roll = sl.Pose.from_euler(np.zeros((201, 3)), 0, 0, 0.05 * np.sin(0.6 * time))
        >>> ship = sl.path_from_samples(time, roll)
        >>> anchors = sl.anchors_on_bases(robot, [(ship, range(8))])
        >>> print(f"{np.abs(anchors.velocity(time)).max():.3f} m/s")
        0.166 m/s
    """
    motions, owner = _checked_bases(instance(robot, Robot, "robot"), bases)
    begin, end = max(one.time[0] for one in motions), min(one.time[-1] for one in motions)
    time = np.unique(np.concatenate([one.time for one in motions]))
    time = time[(time >= begin) & (time <= end)]
    time = time[np.diff(time, prepend=-np.inf) > _SAME * (end - begin)]  # times of two bases that differ by rounding
    if time.size < 2:
        value = f"of one base until {end:g} s, of another from {begin:g} s"
        step = "Give paths of the bases with common times."
        raise InvalidValueError("bases: time", value, "times that overlap", step)
    place = np.repeat(robot.frame_anchors[None], time.size, axis=0)
    for k, base in enumerate(motions):
        carried = np.flatnonzero(owner == k)
        turned = robot.frame_anchors[carried] @ np.swapaxes(base.pose.matrix, -1, -2)
        place[:, carried] = AnchorMotion(base.time, base.pose.position[:, None] + turned).at(time)
    return AnchorMotion(time, place)


def _checked_bases(robot: Robot, bases: Any) -> tuple[list[Path], Indices]:
    """Paths of the bases, and the base of each cable (m,), -1 for a fixed anchor."""
    step = "Give pairs of a path and cables: [(sl.load_path('ship.csv'), [0, 1])]."
    motions: list[Path] = []
    owner = np.full(robot.cable_count, -1)
    for k, base in enumerate(elements(bases, Path, "bases", step, "pairs of a path and cables")):
        if not isinstance(base, tuple | list) or len(base) != 2:
            raise InvalidValueError(f"bases[{k}]", brief(base), "a path and its cables", step)
        motions.append(instance(base[0], Path, f"bases[{k}]: path"))
        for cable in elements(base[1], int, f"bases[{k}]: cables", step):
            i = whole_number(cable, f"bases[{k}]: cable", 0, robot.cable_count - 1)
            if owner[i] >= 0:
                raise InvalidValueError(f"bases[{k}]: cable", i, "a cable on one base", "Name each cable only once.")
            owner[i] = k
        _check_tilt(robot, motions[-1], np.flatnonzero(owner == k), k)
    if not motions:
        raise InvalidValueError("bases", "empty", "pairs of a path and cables", step)
    return motions, owner


def _check_tilt(robot: Robot, base: Path, cables: Indices, k: int) -> None:
    """Refuse a base whose rotation would rotate the swivel axis of a pulley or the run to a drum."""
    if (winches := robot.winches) is None:
        return
    axis = winches.swivel_axis[cables[((winches.pulley_radius > 0.0) | (winches.dead_cable > 0.0))[cables]]]
    away = np.linalg.norm(axis @ np.swapaxes(base.pose.matrix, -1, -2) - axis, axis=-1).max(axis=1, initial=0.0)
    if away.max() > ROUNDING:
        value = f"tilted by {np.degrees(away.max()):.3g} deg at {base.time[np.argmax(away)]:g} s"
        step = "Level the base, or omit the pulleys with robot.replace(winches=None)."
        raise InvalidValueError(f"bases[{k}]: pose", value, "without tilt, because it carries pulleys", step)


def refuse_moving(anchors: AnchorMotion | None, item: str) -> None:
    """Refuse moving anchors, which no page shows."""
    if anchors is not None:
        step = "Draw it: sl.plot.overview(plan), or sl.plot.simulation(run)."
        raise InvalidValueError(item, "with moving anchors", "fixed anchors in the viewer and on shared pages", step)
