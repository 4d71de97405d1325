"""Tours of the ten poses of the article with stops: the remaining errors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import sagline as sl
from sagline.control.checks import Motion
from sagline.control.controller import Controller
from sagline.control.null_space import TensionSettings
from sagline.core.arrays import Array
from sagline.twin.machine import Machine
from tests.control.rigs import HOME, rig
from tests.control.stops import TEN_POSES

OFF = TensionSettings(gain=0.0)
SEEN = 1.0  # s at the end of each stop for the mean: the platform swings by hundredths of a millimeter


class Stops(NamedTuple):
    """Results at N stops.

    Attributes:
        place: Of the true platform [m], shape (N, 3).
        error: Of that [m], shape (N,).
        tension: Error of the tensions in the directions that the loop can change, rms over cables [N], shape (N,).
        correction: Of the tension loop, largest of a stop [m], shape (N,).
        acting: Share of the cycles in which the loop acted.
        seconds: On the machine's clock [s].
        cycles: Of the whole tour.
    """

    place: Array
    error: Array
    tension: Array
    correction: Array
    acting: float
    seconds: float
    cycles: int


def tour(true: sl.Robot, speed: float, stand: float, count: int = 10, loop: TensionSettings | None = None) -> Stops:
    """Home and a number of the ten poses, with a stop at each.

    Args:
        true: The true robot.
        speed: Largest speed of the path [m/s].
        stand: Duration of each stop [s].
        count: Number of poses.
        loop: The tension loop.
    """
    control, machine = rig(true, loop=loop)
    begin, first, here = machine.time, len(control.events), HOME.position
    stops, acting, cycles = [], 0, 0
    for pose in TEN_POSES[:count]:
        motion = control.plan(sl.quintic_path([here, pose], speed=speed))
        control.start(motion)
        while control.moving:
            control.cycle()
            acting, cycles = acting + acts(control), cycles + 1
        here = pose
        stops.append(_stop(control, machine, motion, stand))
        cycles += round(stand / control.period)
    assert {event.kind.value for event in control.events[first:]} == {"state"}  # no fault and no note
    place, tension, correction = (np.array(column) for column in zip(*stops, strict=True))
    error = np.linalg.norm(place - TEN_POSES[:count], axis=1)
    return Stops(place, error, tension, correction, acting / cycles, machine.time - begin, cycles)


def acts(control: Controller) -> bool:
    """True if the tension loop acts."""
    return control._context.tension_loop is not None and control._context.tension_loop.acting


def _stop(control: Controller, machine: Machine, motion: Motion, stand: float) -> tuple[Array, float, float]:
    places, tensions = [], []
    for left in range(round(stand / control.period), 0, -1):
        control.cycle()
        if left <= round(SEEN / control.period):
            places.append(machine.reading.position.copy())
            tensions.append(machine.reading.tension.copy())
    assert motion.gains is not None
    seen = motion.gains.rows[-1].visible @ (np.mean(tensions, axis=0) - motion.tension[-1])
    largest = float(np.abs(control._context.correction).max())
    return np.mean(places, axis=0), float(np.sqrt(np.mean(seen**2))), largest
