"""Bounds of cables over a box of poses compared with random poses; slopes compared with differences."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.tables import BODY_COLUMNS, CABLE_COLUMNS
from sagline.kernels.workspaces import box_tensions
from sagline.kernels.workspaces.box_tensions import MOTIONS, CablesInBox, PoseRange
from tests.kernels.compiled import from_python

set_place, geometry_of = from_python(box_tensions.set_cables_in_box), from_python(cable_geometry)
M = 8


class Given(NamedTuple):
    """A robot at a pose, as kernel arguments."""

    cables: Array
    body: Array
    pose: Array


def _given(rng: np.random.Generator) -> Given:
    cables = np.zeros((M, CABLE_COLUMNS))
    cables[:, :3] = rng.uniform(-4, 4, (M, 3))
    cables[:, 3:6] = rng.uniform(-0.5, 0.5, (M, 3))
    body = np.zeros(BODY_COLUMNS)
    body[2:] = rng.uniform(-0.2, 0.2, 3)
    return Given(cables, body, np.append(rng.uniform(-1, 1, 3), Rotation.random(random_state=rng).as_quat()))


def _place(given: Given, box: PoseRange) -> tuple[CablesInBox, bool]:
    rotation, geometry = np.empty((3, 3)), np.empty((g.GEOMETRY_ROWS, M))
    geometry_of(given.cables, given.body, given.pose, rotation, geometry)
    place = CablesInBox(
        np.empty((6, 6)), np.empty((6, M)), np.empty((6, M)), np.empty((3, M)), np.zeros((MOTIONS, 6 * M)),
        *np.empty((5, M)),
    )  # fmt: skip
    possible = set_place(np.eye(6), geometry, rotation, given.body[2:].copy(), box, place)
    return place, possible


def _moved(given: Given, motion: Array) -> Given:
    turned = Rotation.from_rotvec(motion[3:]) * Rotation.from_quat(given.pose[3:])
    return given._replace(pose=np.append(given.pose[:3] + motion[:3], turned.as_quat()))


@pytest.mark.parametrize("turn", [0.0, 0.1, 0.5])
def test_bounds(turn: float) -> None:
    rng = np.random.default_rng(4)
    nearest = np.zeros(3)
    for _ in range(15):
        given = _given(rng)
        box = PoseRange(0.3 * rng.uniform(0.2, 1.0, 3), turn)
        place, possible = _place(given, box)
        if not possible:
            continue
        for _ in range(60):
            motion = np.append(rng.choice([-1.0, 1.0], 3) * box.half, rng.normal(size=3))
            motion[3:] *= turn / np.linalg.norm(motion[3:])
            there, _ = _place(_moved(given, motion), PoseRange(np.zeros(3), 0.0))
            linear = place.full + (motion @ place.slopes).reshape(6, M)
            ways = np.linalg.norm(there.full[:3] - place.full[:3], axis=0)
            bent = np.linalg.norm(there.full[:3] - linear[:3], axis=0)
            swung = np.linalg.norm(there.lever - place.lever, axis=0)
            shares = ways / place.turned, bent / place.bent, swung / np.maximum(place.swung, 1e-12)
            assert max(share.max() for share in shares[:2]) <= 1.0 + 1e-9
            assert (swung <= place.swung + 1e-12).all()
            nearest = np.maximum(nearest, [share.max() for share in shares])
    assert nearest[0] > 0.9
    assert nearest[1] > 0.4


def test_slopes() -> None:
    rng = np.random.default_rng(5)
    step = 1e-6
    for _ in range(10):
        given = _given(rng)
        place, _ = _place(given, PoseRange(np.zeros(3), 1e-3))
        for motion in range(MOTIONS):
            ends = [
                _place(_moved(given, side * step * np.eye(6)[motion]), PoseRange(np.zeros(3), 0.0))[0]
                for side in (1, -1)
            ]
            slope = (ends[0].full - ends[1].full) / (2 * step)
            np.testing.assert_allclose(place.slopes[motion].reshape(6, M), slope, atol=1e-7)
