"""Cables as vibrating strings: data for their vibrations about an equilibrium."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array, Flags, Indices
from sagline.kernels import codes
from sagline.kernels.cable.geometry import CABLE_ROWS
from sagline.kernels.dynamics import collocation
from sagline.kernels.dynamics import string as columns
from sagline.kernels.dynamics.collocation import dynamic_stiffnesses
from sagline.kernels.dynamics.string import fill_routing_compliance
from sagline.robot.batch import cables_of, first_of, robot_fields
from sagline.robot.equilibrium import Equilibrium
from sagline.statics.tables import cable_table

FOLD = 1e-6  # a cable with a tension below this share of its weight is folded, and has no linear vibration
# [rad], < pi: phase per element for the count of modes; frequencies then have a relative error of 1e-13
COUNTING = 0.75 * np.pi
# A cable with a tension below this share of EA is slack: its stiffnesses differ too much for the computation.
SLACK = 1e-7
_TINY = 1e-300


class Strings(NamedTuple):
    """Data of the cables as vibrating strings, for N equilibria."""

    table: Array  # columns of `sagline.kernels.dynamics.string`, shape (N, m, STRING_COLUMNS)
    axes: Array  # axes of each cable: horizontal in its plane, normal to its plane, upward, shape (N, m, 3, 3)
    taut: Flags  # True for cables that are neither folded nor slack, shape (N, m)


def strings_of(state: Equilibrium) -> Strings:
    """String data of the cables of an equilibrium."""
    cables = state.cables
    m = cables.shape[-1]
    material = cables_of(state.robot)
    weight = 0.0 if cables.model.weightless else material.linear_density * first_of(state.robot).gravity
    forces = (cables.horizontal_tension, cables.vertical_force)
    known = (*forces, cables.unstrained_length, weight, material.axial_stiffness, material.linear_density)
    table = np.zeros((*cables.shape, columns.STRING_COLUMNS))
    for k, field in enumerate(known):
        table[..., k] = field
    table = table.reshape(-1, m, columns.STRING_COLUMNS)
    if state.contact is not None:
        exact = cables.model.code == codes.CATENARY
        leaving = (cables.frame_end_tension if exact else state.chord_tension).reshape(-1, m)
        terms = cables.model.terms(first_of(state.robot).gravity)
        wraps = np.array(state.contact.wrap_angle).reshape(-1, m)
        fill_routing_compliance(
            terms, cable_table(state.robot), wraps, np.array(leaving), np.empty((CABLE_ROWS, m)), table
        )
    return Strings(table, _axes(state).reshape(-1, m, 3, 3), taut_of(table))


def strings_below(strings: Strings, frequency: Array) -> Indices:
    """Number (N, F, m) of natural frequencies of a cable with fixed ends that are below `frequency` (N, F) [Hz]."""
    below = np.zeros((*frequency.shape, strings.taut.shape[1]), dtype=np.int64)
    waves, room = undamped(frequency), np.empty(collocation.ROOM)
    for row, taut in enumerate(strings.taut):
        table = np.ascontiguousarray(strings.table[row : row + 1, taut])
        found = np.empty((1, waves.shape[1], table.shape[1], collocation.FOUND))
        counts = np.empty((*found.shape[:-1], 2), dtype=np.int64)
        dynamic_stiffnesses(table, waves[row : row + 1], COUNTING, room, found, counts)
        below[row][:, taut] = np.maximum(counts[0], 0).sum(axis=-1)
    return below


def undamped(frequency: Array) -> Array:
    """Data (N, F, WAVE_COLUMNS) for kernels about waves in undamped cables at frequencies (N, F) [Hz]."""
    waves = np.zeros((*frequency.shape, collocation.WAVE_COLUMNS))
    waves[..., collocation.OMEGA] = omega = 2.0 * np.pi * frequency
    waves[..., collocation.SQUARE] = omega**2
    waves[..., collocation.ACROSS] = waves[..., collocation.ALONG] = 1.0
    return waves


def _axes(state: Equilibrium) -> Array:
    """Axes of each cable as the rows of a matrix, shape (..., m, 3, 3); world axes for a vertical cable."""
    frame, platform = robot_fields(state.robot, "frame_anchors", "platform_anchors")
    turned = platform @ np.swapaxes(state.pose.matrix, -1, -2)
    level = (state.pose.position[..., None, :] + turned - frame)[..., :2]
    length = np.hypot(level[..., 0], level[..., 1])
    upright = length == 0.0
    cosine = np.where(upright, 1.0, level[..., 0] / np.maximum(length, _TINY))
    sine = np.where(upright, 0.0, level[..., 1] / np.maximum(length, _TINY))
    axes = np.zeros((*cosine.shape, 3, 3))
    axes[..., 0, 0], axes[..., 0, 1] = cosine, sine
    axes[..., 1, 0], axes[..., 1, 1] = -sine, cosine
    axes[..., 2, 2] = 1.0
    return axes


def taut_of(table: Array) -> Flags:
    """True for each cable that is neither folded nor slack, (N, m); table: string data (N, m, STRING_COLUMNS)."""
    top = table[..., columns.VERTICAL]
    hanging = table[..., columns.WEIGHT] * table[..., columns.LENGTH]
    vertical = np.maximum(np.maximum(top - hanging, -top), 0.0)
    least = np.hypot(table[..., columns.HORIZONTAL], vertical)
    few = np.maximum(FOLD * hanging, SLACK * table[..., columns.STIFFNESS])
    return np.asarray(least > np.maximum(few, _TINY))
