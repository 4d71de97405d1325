"""Vibration of a robot at rest, and its modes in motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.dynamics.simulation.chain_plant import wave_frequency
from sagline.dynamics.simulation.initial_conditions import initial_conditions
from sagline.dynamics.simulation.results import Break, Simulation
from sagline.dynamics.simulation.simulate import started_run
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.dynamics.vibration.mode_list import (
    WITH_MASS,
    ListedMode,
    end_displacements,
    listed_modes,
    quasi_static_displacements,
)
from sagline.dynamics.vibration.vibration import Vibration, vibration
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.statics.stiffness import modes
from sagline.viewer import lines, solids

DAMPING: Final = Damping(modal_damping=0.01)
LOSSES: Final = Damping(loss_time=1e-3)
PARTS: Final = (0.03, 0.1, 0.3, 0.7, 1.5, 2.8, 4.2)  # s: ends of the parts; the first is soon there, and soon played
DURATION: Final = PARTS[-1]
NODES = 10  # of a cable with mass: four times as fast as twice as many


def vibrating(state: Equilibrium, up_to: float) -> Vibration:
    """All modes below a frequency [Hz]."""
    return vibration(state, up_to=up_to, damping=DAMPING)


def cut(state: Equilibrium, cable: int, cable_mass: str) -> Iterator[Simulation]:
    """Simulation of the break of a cable, the other lengths kept; each part is longer and begins as the one before."""
    given = initial_conditions(state, None, None, DURATION)
    elements = NODES if cable_mass == "lumped" else 0
    losses = LOSSES
    if elements:  # waves in stiff cables are not to take smaller steps for their losses than for themselves
        losses = Damping(loss_time=min(LOSSES.loss_time, 2.0 / wave_frequency(given, elements)))
    run = started_run(given, elements, events=(Break(cable=cable, time=0.0),), damping=losses)
    for part in PARTS:
        yield run.until(part)


DRAWN = 0.035  # of the robot's size: how far what swings farthest is drawn from its rest
MOST_TURN = 0.3  # rad: farthest that the platform is drawn turned
ENERGY = 1.0  # J, of the vibration that the drawing is compared with
PERIOD = 2.0  # s of one swing as it is drawn


@dataclass(frozen=True, slots=True, eq=False)
class Swing:
    """Motion of a mode as it is drawn."""

    mode: ListedMode
    state: Equilibrium  # the equilibrium
    factor: float  # factor of the drawn amplitude over that of an energy of one joule
    motion: Array  # of the platform as drawn: displacement of the center of mass [m], rotation vector [rad], shape (6,)
    rest: Array  # points of the cables at rest [m], shape (m, P, 3)
    moved: Array  # their displacement as drawn, shape (m, P, 3)

    @classmethod
    def of(cls, vibration: Vibration, mode: ListedMode) -> Swing:
        """The drawing of one of the modes that a vibration lists."""
        state, k = vibration.state, mode.number - 1
        if mode.kind == WITH_MASS:
            shape, cables = vibration.shape[:, k], lines.resampled(vibration.cable_shape[k], lines.POINTS)
        else:
            shape = modes(state).shape[:, k]
            cables = quasi_static_displacements(state, end_displacements(state, shape[:, None])[..., 0], lines.POINTS)
        wraps, free = _at_rest(state)
        farthest = max(float(np.linalg.norm(cables, axis=-1).max()), float(np.linalg.norm(shape[:3])))
        scale = DRAWN * solids.size_of(state.one_robot) / farthest
        scale = min(scale, MOST_TURN / max(float(np.linalg.norm(shape[3:])), 1e-12))
        at_one_joule = np.sqrt(2.0 * ENERGY) / (2.0 * np.pi * mode.frequency)  # of unit modal mass
        moved = scale * np.concatenate((np.zeros_like(wraps), cables), axis=1)
        return cls(mode, state, scale / at_one_joule, scale * shape, np.concatenate((wraps, free), axis=1), moved)

    def pose(self, phase: float) -> Pose:
        """Pose at a phase [rad], the equilibrium at 0."""
        share, rest, center = np.sin(phase), self.state.pose, self.state.one_robot.center_of_mass
        rotation = Rotation.from_rotvec(share * self.motion[3:]) * rest.rotation
        place = rest.transform(center) + share * self.motion[:3] - rotation.as_matrix() @ center
        return Pose(place, rotation)

    def courses(self, phase: float) -> Array:
        """Points of the cables at a phase [rad], shape (m, P, 3): their ends are on the platform, however it turns."""
        courses = self.rest + np.sin(phase) * self.moved
        gap = self.pose(phase).transform(self.state.one_robot.platform_anchors) - courses[:, -1]
        share = np.zeros(courses.shape[1])
        share[-lines.POINTS :] = np.linspace(0.0, 1.0, lines.POINTS)
        return np.asarray(courses + share[:, None] * gap[:, None])

    @property
    def text(self) -> str:
        """Factors of size and speed of the drawing."""
        slower = PERIOD * self.mode.frequency
        speed = f"{slower:.3g} times slower" if slower >= 1.0 else f"{1.0 / slower:.3g} times faster"
        return f"drawn {self.factor:.2g} times as large as a vibration of {ENERGY:g} J is, {speed}"


def mode_of(vibration: Vibration, name: str) -> ListedMode | None:
    """The mode of this name, "1" or "massless 1"; None where there is none."""
    wanted = " ".join(name.split())
    return next((mode for mode in listed_modes(vibration) if mode.name == wanted), None)


def _at_rest(state: Equilibrium) -> tuple[Array, Array]:
    """Points of the cables on their pulleys, and hanging."""
    robot = state.one_robot
    wraps = lines.wraps(robot, state.pose, None if state.contact is None else state.contact.wrap_angle)
    if wraps.shape[1] == 1:
        return wraps[:, :0], lines.catenaries(lines.chords(robot, state.pose), state.cables, 1.0)
    return wraps, lines.catenaries(lines.chords(robot, state.pose, wraps[:, -1]), state.cables, 1.0)
