"""Tensions, sag and stiffness of candidates: tables of cables in, no robot made."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, locked
from sagline.core.progress import blocks
from sagline.kernels import codes, tables
from sagline.kernels.cable.shape import sags
from sagline.kernels.forward.sensitivity import DATA, describe_states
from sagline.kernels.inverse.poses import inverse_poses
from sagline.kernels.memory import memory_for
from sagline.kinematics.inverse_rows import Found
from sagline.robot.robot import Robot
from sagline.robot.several import anything_behind
from sagline.statics.stiffness import compliance_of
from sagline.statics.tables import body_table
from sagline.tension.minimum_norm import MinimumNorm
from sagline.tension.options import kernel_options

BLOCK = 1 << 12  # poses at once: a tenth of a second, after which an interrupt is heard


class Planned(NamedTuple):
    """Of each pose, shape (N,); NaN where there are no tensions.

    Attributes:
        tension: Largest of the cables [N].
        sag: Largest of the cables [m].
        stiffness: Against the force on the center of mass that meets the least [N/m]; None if nobody asked.
    """

    tension: Array
    sag: Array
    stiffness: Array | None


def planned(robot: Robot, model: CableModel, cables: Array, poses: Array, wrench: Array, *, stiffness: bool) -> Planned:
    """Share the load by the minimum norm.

    Args:
        robot: What all candidates share.
        model: Cable model.
        cables: Tables, one a pose, shape (N, m, CABLE_COLUMNS).
        poses: Pose rows (N, POSE_COLUMNS).
        wrench: On the platform, shape (6,).
        stiffness: Whether it is asked for.
    """
    method = MinimumNorm()
    options = kernel_options(robot, model, method.alone)
    count, m = cables.shape[:2]
    behind = anything_behind(robot)
    found = Found.empty(count, m, robot.degrees_of_freedom, behind)
    body, load, memory = body_table(robot), locked(np.atleast_2d(wrench).copy()), memory_for(m)
    cables, poses = locked(np.ascontiguousarray(cables)), locked(np.ascontiguousarray(poses))
    terms = (robot.freedom, body, cables)
    reference = np.full(m, np.nan)
    for part in blocks(count, BLOCK):
        inverse_poses(*options, terms, poses, load, reference, memory, None, found.answers, part.start, part.stop)
    lost = found.pose_status != codes.POSE_SOLVED
    found.results[tables.LENGTH :, lost] = np.nan
    tension = found.results[tables.TENSION].max(axis=-1)
    sag = _sag(model, robot.gravity, found.results, cables).max(axis=-1)
    stiff = _stiffness(robot, model, found.results, (cables, poses, load), behind) if stiffness else None
    return Planned(tension, sag, stiff)


def _sag(model: CableModel, gravity: float, results: Array, cables: Array) -> Array:
    """Largest drop below the chord of each cable [m], (N, m)."""
    length = results[tables.LENGTH]
    if len(results) > tables.BARE_ROWS:
        length = length - (results[tables.WRAPPED] + results[tables.DEAD])
    rows = (
        *(results[tables.SPAN], results[tables.RISE], cables[..., tables.DENSITY], cables[..., tables.STIFFNESS]),
        *(length, results[tables.HORIZONTAL], results[tables.VERTICAL], results[tables.TENSION]),
    )
    span, rise, density, stiffness, free, horizontal, vertical, tension = (
        locked(np.ascontiguousarray(row).reshape(-1)) for row in rows
    )
    out = np.empty(length.size)
    sags(model.terms(gravity), span, rise, density, stiffness, free, horizontal, vertical, tension, out)
    return out.reshape(length.shape)


def _stiffness(
    robot: Robot, model: CableModel, results: Array, given: tuple[Array, Array, Array], behind: bool
) -> Array:
    """Force over displacement of the center of mass in the softest direction [N/m], (N,)."""
    cables, poses, load = given
    count, m = cables.shape[:2]
    matrices, levers = np.empty((count, 6, 6)), np.empty((count, m, 3))
    blocks_of, slopes = np.empty((count, m, 3, 3)), np.empty((count, DATA, m, 3))
    code = (model.code, *model.parameters, behind or None)
    lengths = locked(np.ascontiguousarray(results[tables.LENGTH]))
    terms = (robot.freedom, body_table(robot), cables, lengths, poses, load)
    describe_states(code, terms, memory_for(m), matrices, blocks_of, slopes, levers)
    compliance = compliance_of(robot.freedom, matrices)[:, :3, :3]
    known = np.asarray(np.isfinite(compliance).all(axis=(-1, -2)))
    symmetric = np.where(known[:, None, None], 0.5 * (compliance + np.swapaxes(compliance, -1, -2)), 0.0)
    softest = np.abs(np.linalg.eigvalsh(symmetric)).max(axis=-1)
    return np.asarray(np.where(known & (softest > 0.0), 1.0 / np.where(softest > 0.0, softest, 1.0), np.nan))
