"""Animated motion of a mode."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.dynamics.vibration.flexibility import end_displacements, quasi_static_displacements
from sagline.dynamics.vibration.vibration import WITH_MASS, ListedMode, Vibration, listed_modes
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.statics.stiffness import modes
from sagline.viewer import shapes

DRAWN: Final = 0.035  # largest drawn displacement, as a share of the robot's size
MOST_TURN: Final = 0.3  # largest drawn rotation of the platform [rad]
ENERGY: Final = 1.0  # energy of the reference vibration [J]
PERIOD: Final = 2.0  # period of the drawn motion [s]


@dataclass(frozen=True, slots=True, eq=False)
class Swing:
    """Animated motion of a mode."""

    mode: ListedMode
    state: Equilibrium
    factor: float  # ratio of the drawn amplitude to that of a vibration with an energy of 1 J
    motion: Array  # drawn displacement of the center of mass [m] and rotation vector of the platform [rad], shape (6,)
    rest: Array  # points of the cables at rest [m], shape (m, P, 3)
    moved: Array  # drawn displacements of these points [m], shape (m, P, 3)

    @classmethod
    def of(cls, vibration: Vibration, mode: ListedMode) -> Swing:
        """Motion of one of the modes of a vibration."""
        state, k = vibration.state, mode.number - 1
        if mode.kind == WITH_MASS:
            shape, cables = vibration.shape[:, k], shapes.resampled(vibration.cable_shape[k], shapes.POINTS)
        else:
            shape = modes(state).shape[:, k]
            cables = quasi_static_displacements(state, end_displacements(state, shape[:, None])[..., 0], shapes.POINTS)
        farthest = max(float(np.linalg.norm(cables, axis=-1).max()), float(np.linalg.norm(shape[:3])))
        scale = DRAWN * shapes.size_of(state.one_robot) / farthest
        scale = min(scale, MOST_TURN / max(float(np.linalg.norm(shape[3:])), 1e-12))
        at_one_joule = np.sqrt(2.0 * ENERGY) / (2.0 * np.pi * mode.frequency)  # motion with unit modal mass
        rest = shapes.courses(state.one_robot, state.pose, state, 1.0)
        moved = np.zeros_like(rest)  # the points on the pulleys are at rest
        moved[:, -shapes.POINTS :] = scale * cables
        return cls(mode, state, scale / at_one_joule, scale * shape, rest, moved)

    def pose(self, phase: float) -> Pose:
        """Pose at a phase [rad]; the equilibrium at phase 0."""
        share, rest, center = np.sin(phase), self.state.pose, self.state.one_robot.center_of_mass
        rotation = Rotation.from_rotvec(share * self.motion[3:]) * rest.rotation
        place = rest.transform(center) + share * self.motion[:3] - rotation.as_matrix() @ center
        return Pose(place, rotation)

    def courses(self, phase: float) -> Array:
        """Points of the cables at a phase [rad], shape (m, P, 3); their ends remain on the platform."""
        courses = self.rest + np.sin(phase) * self.moved
        gap = self.pose(phase).transform(self.state.one_robot.platform_anchors) - courses[:, -1]
        share = np.zeros(courses.shape[1])
        share[-shapes.POINTS :] = np.linspace(0.0, 1.0, shapes.POINTS)
        return np.asarray(courses + share[:, None] * gap[:, None])

    @property
    def text(self) -> str:
        """Text of the size and speed factors of the drawing."""
        slower = PERIOD * self.mode.frequency
        speed = f"{slower:.3g} times slower" if slower >= 1.0 else f"{1.0 / slower:.3g} times faster"
        return f"drawn {self.factor:.2g} times as large as a vibration of {ENERGY:g} J, {speed}"


def mode_of(vibration: Vibration, name: str) -> ListedMode | None:
    """The mode with a name, "1" or "massless 1"; None if there is none."""
    cleaned = " ".join(name.split())
    return next((mode for mode in listed_modes(vibration) if mode.name == cleaned), None)
