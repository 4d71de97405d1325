"""Forces of the cables on the frame: at anchors, pulleys, guides and winches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.core.results import Columns, Result, Tabular
from sagline.kernels import codes
from sagline.motion.path import Path
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.routing import guide_forces, tension_after
from sagline.robot.winch import Winch

_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FrameForces(Result, Tabular):
    """Result of `Plan.frame_forces`: forces of the cables on the frame at one pose, or at N poses.

    All forces are in world axes, shape (m, 3) or (N, m, 3), NaN without a solution. The sum of `pulley`, `winch` and
    `guides` of all cables is the external and inertial force on the platform plus the weight of platform and cables.
    The mass of a platform with winches includes their cables.

    Attributes:
        state: Robot, poses and cables.
        path: The path of the plan; None for poses without times.
        exit: Force of the free span on the frame at the exit point [N]: cable force at the frame end. With a winch on
            the platform, this point is the frame anchor.
        pulley: Force on the axle of the pulley, on the eyelet or on the anchor [N]: free span, cable between pulley and
            drum, and weight of the cable on the pulley. It is equal to `exit` if the frame has no cable behind
            the anchor.
        winch: Force on the winch [N]. Without `guides` in the robot's winches, it is the sum of the forces on winch
            and everything that guides the cable behind the pulley; zero if no cable continues behind the anchor.
        guides: Forces on the guides between winch and frame anchor [N], in the order of `Winch.guides` without the
            first, which is the winch, shape (..., m, k - 1, 3); (..., m, 0, 3) without guides.
    """

    _columns: ClassVar[Columns] = (
        "path.time",
        "state.pose",
        *(f"{name}#=pulley.{axis}" for axis, name in enumerate(("Fx", "Fy", "Fz"))),
        "F#=magnitude",
        *(f"{name}#=winch.{axis}" for axis, name in enumerate(("Wx", "Wy", "Wz"))),
    )

    state: Equilibrium
    path: Path | None
    exit: Array
    pulley: Array
    winch: Array
    guides: Array

    @property
    def magnitude(self) -> Array:
        """Magnitude of the force on each pulley or anchor [N], shape (m,) or (N, m)."""
        return locked(np.linalg.norm(self.pulley, axis=-1))

    @property
    def largest(self) -> Array:
        """Force on each pulley or anchor at the pose at which its magnitude is largest [N], shape (m, 3).

        Poses without a solution do not count; NaN if no pose has a solution.
        """
        forces = self.pulley.reshape(-1, *self.pulley.shape[-2:])
        size = np.nan_to_num(np.linalg.norm(forces, axis=-1), nan=-1.0)
        return locked(np.take_along_axis(forces, size.argmax(axis=0)[None, :, None], axis=0)[0])

    @property
    def extremes(self) -> Array:
        """Smallest and largest component of the force on each pulley or anchor [N], shape (2, m, 3)."""
        forces = self.pulley.reshape(-1, *self.pulley.shape[-2:])
        ends = (np.fmin.reduce(forces, axis=0), np.fmax.reduce(forces, axis=0))
        return locked(np.stack(ends))


def frame_forces_of(state: Equilibrium, path: Path | None) -> FrameForces:
    """Forces of the cables on the frame; see `Plan.frame_forces`."""
    from sagline.statics.slopes import frame_end_forces  # not needed for a plan alone

    robot, contact, exit_force = state.one_robot, state.contact, frame_end_forces(state)
    winches = robot.winches
    guided = np.zeros((*exit_force.shape[:-1], 0, 3))
    if contact is None or winches is None:
        pulley, winch = exit_force, np.zeros(exit_force.shape)
    else:
        at_frame = ~winches.on_platform
        on_pulley, behind = ((each * at_frame)[..., None] * _UP for each in _weights(state))
        if winches.guides is not None:
            forces = guide_forces(state)
            pulley, winch = exit_force - on_pulley + forces[..., 0, :], forces[..., -1, :]
            guided = forces[..., -2:0:-1, :]
        else:
            continues = ((winches.pulley_radius > 0.0) | (winches.dead_cable > 0.0)) & at_frame
            pull = np.where(continues, _entry_tension(state, winches), 0.0)[..., None] * winches.swivel_axis
            pulley, winch = exit_force - pull - on_pulley, pull - behind
    fields = (np.ascontiguousarray(each) for each in (exit_force, pulley, winch, guided))
    return FrameForces(state, path, *map(locked, fields))


def _weights(state: Equilibrium) -> tuple[Array, Array]:
    """Weights [N] of the cables on the pulleys and behind them, (..., m); zero in all models but the exact one."""
    robot, contact = state.one_robot, state.contact
    assert contact is not None
    exact = state.cables.model.code == codes.CATENARY
    weight = robot.cables.linear_density * robot.gravity if exact else np.zeros(robot.cable_count)
    return weight * contact.wrapped_length, weight * contact.dead_length


def _entry_tension(state: Equilibrium, winches: Winch) -> Array:
    """Tensions [N] of the cables at the frame anchors, on the drum sides of the pulleys, (..., m)."""
    # Along an exact cable, T + T^2/(2 EA) - w z is constant (docs/model.md, 10); friction multiplies the tension at the
    # exit point.
    robot, cables, contact = state.one_robot, state.cables, state.contact
    assert contact is not None
    winding = 0.0 if contact.winding is None else contact.winding
    exact = cables.model.code == codes.CATENARY
    tension = cables.frame_end_tension if exact else state.chord_tension
    tension = tension * np.exp(winding * winches.pulley_friction * contact.wrap_angle)
    tension = tension * (1.0 + winding * winches.rolling_friction)
    if not exact:
        return tension
    fall = state.exit_point[..., 2] - robot.frame_anchors[:, 2]
    stiffness = robot.cables.axial_stiffness
    return tension_after(tension, 2.0 * robot.cables.linear_density * robot.gravity * fall / stiffness, stiffness)
