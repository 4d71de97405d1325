"""Setting of a pose compared with NumPy: limits, structure matrix, pseudo-inverse, null space, and failures."""

import math
from typing import NamedTuple

import numpy as np
import pytest

from sagline.core.arrays import Array
from sagline.kernels import statics as s
from sagline.kernels import tables
from sagline.kernels.algebra.bounds import HIGH, LOW, START
from sagline.kernels.cable import states
from sagline.kernels.cable.states import TensionLimits
from sagline.kernels.cable.terms import Cables, Chord, Material, Model, Pulley, new_cables
from sagline.kernels.codes import (
    CATENARY,
    CHORD_TENSION,
    EMPIRICAL,
    FRAME_END_TENSION,
    HORIZONTAL_TENSION,
    LIMITS_OF_CHORD,
    LIMITS_OF_FRAME_END,
    POSE_NO_CHORD,
    POSE_SINGULAR,
    POSE_SOLVED,
)
from tests.kernels.balance.robots import (
    A_POINT,
    EVERY_MOTION,
    GRAVITY,
    IN_A_PLANE,
    TO_AND_FRO,
    Case,
    random_case,
)
from tests.kernels.compiled import from_python, memory

set_pose = from_python(s.set_pose)
need = from_python(s.fill_needed_wrench)
start_from_minimum_norm = from_python(s.start_from_minimum_norm)
room_for_cables = from_python(new_cables)
room_for_balance = from_python(s.new_balance)
frame_end_tension = from_python(states.frame_end_tension)

EXACT = Model(CATENARY, 0.0, 0.0, GRAVITY)
NO_PULLEY = Pulley(0.0, 1.0, 0.0, 0.0)
NO_BOUND = TensionLimits(LIMITS_OF_CHORD, math.nan)
VARIABLES = [CHORD_TENSION, HORIZONTAL_TENSION, FRAME_END_TENSION]


class Set(NamedTuple):
    status: int
    cables: Cables
    balance: s.Balance
    platform: s.Platform


def setting(
    case: Case,
    variable: int = CHORD_TENSION,
    weight: Array | None = None,
    limits: TensionLimits = NO_BOUND,
    model: Model = EXACT,
) -> Set:
    m = len(case.robot)
    cables, rest = room_for_cables(memory(10000), m, False)
    balance, _ = room_for_balance(rest, m, len(case.freedom))
    platform = s.Platform(*case)
    status = set_pose(model, limits, variable, np.ones(m) if weight is None else weight, platform, cables, balance)
    return Set(status, cables, balance, platform)


@pytest.mark.parametrize("variable", VARIABLES)
@pytest.mark.parametrize(
    ("m", "freedom"),
    [(8, EVERY_MOTION), (7, EVERY_MOTION), (12, EVERY_MOTION), (5, IN_A_PLANE), (6, A_POINT), (2, TO_AND_FRO)],
)
def test_balance_of_a_pose(m: int, freedom: Array, variable: int) -> None:
    for seed in range(5):
        rng = np.random.default_rng(seed)
        case, weight = random_case(rng, m, freedom, flat=freedom is IN_A_PLANE), rng.uniform(0.5, 2.0, m)
        status, cables, balance, platform = setting(case, variable, weight)
        assert status == POSE_SOLVED
        chord = np.linalg.norm(case.chords, axis=1)
        sine, cosine = case.chords[:, 2] / chord, np.hypot(case.chords[:, 0], case.chords[:, 1]) / chord
        half = 0.5 * case.robot[:, tables.DENSITY] * GRAVITY * chord
        for found, expected in (
            (cables.chord, chord),
            (cables.sine, sine),
            (cables.cosine, cosine),
            (cables.density, case.robot[:, tables.DENSITY]),
            (cables.stiffness, case.robot[:, tables.STIFFNESS]),
            (cables.half_weight, half),
            (cables.sag_force, half),  # first order
            (cables.low, case.robot[:, tables.TENSION_MIN]),
            (cables.high, case.robot[:, tables.TENSION_MAX]),
        ):
            np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-15)
        scale = weight * (cosine if variable == HORIZONTAL_TENSION else 1.0)
        np.testing.assert_allclose(balance.scale, scale, rtol=1e-13)
        np.testing.assert_allclose(balance.offset, -half * sine if variable == FRAME_END_TENSION else 0.0, rtol=1e-13)
        np.testing.assert_allclose(balance.bounds[LOW], cables.low * scale, rtol=1e-13)
        np.testing.assert_allclose(balance.bounds[HIGH], cables.high * scale, rtol=1e-13)
        np.testing.assert_allclose(balance.matrix, case.structure, atol=1e-14)
        scaled = case.structure / scale
        large = float(np.linalg.norm(np.linalg.pinv(scaled)))
        np.testing.assert_allclose(balance.inverse.T, np.linalg.pinv(scaled), atol=1e-13 * large**2)
        np.testing.assert_allclose(balance.null @ balance.null.T, np.eye(m - len(freedom)), atol=1e-14)
        np.testing.assert_allclose(scaled @ balance.null.T, 0.0, atol=1e-14 * np.abs(scaled).max())
        cables.sag_force[:] = rng.uniform(0.0, 3.0, m)
        need(platform, cables, balance)
        np.testing.assert_allclose(balance.right, freedom @ balance.needed, atol=1e-13)
        start_from_minimum_norm(balance)
        np.testing.assert_allclose(scaled @ balance.bounds[START], balance.right, atol=1e-12 * large)
        np.testing.assert_allclose(balance.null @ balance.bounds[START], 0.0, atol=1e-11 * large)


def test_an_infinite_limit_is_infinite_in_every_variable() -> None:
    case = random_case(np.random.default_rng(3), 8)
    case.robot[2, tables.TENSION_MAX] = math.inf
    for variable in VARIABLES:
        for quantity in (LIMITS_OF_CHORD, LIMITS_OF_FRAME_END):
            balance = setting(case, variable, limits=TensionLimits(quantity, math.nan)).balance
            assert list(np.flatnonzero(np.isinf(balance.bounds[HIGH]))) == [2]


def test_limits_of_the_frame_end() -> None:
    case = random_case(np.random.default_rng(4), 8)
    cables = setting(case, limits=TensionLimits(LIMITS_OF_FRAME_END, math.nan)).cables
    for i in range(8):
        chord = Chord(cables.chord[i], cables.sine[i], cables.cosine[i])
        material = Material(cables.density[i], cables.stiffness[i])
        for limit, column in ((cables.low[i], tables.TENSION_MIN), (cables.high[i], tables.TENSION_MAX)):
            assert frame_end_tension(EXACT, chord, material, NO_PULLEY, limit) == pytest.approx(
                case.robot[i, column], rel=1e-11
            )


def test_the_bound_of_validity_raises_the_lower_limit() -> None:
    case = random_case(np.random.default_rng(5), 8)
    cables = setting(case, limits=TensionLimits(LIMITS_OF_CHORD, 2.0), model=Model(EMPIRICAL, 4.9, 4.0, GRAVITY)).cables
    # (54): T_x = tau cos phi > w D cos phi/(2 |sin phi|) + T_adj
    bound = cables.half_weight * cables.cosine / np.abs(cables.sine) + 2.0
    np.testing.assert_allclose(cables.low, np.maximum(case.robot[:, tables.TENSION_MIN], bound / cables.cosine))
    assert (cables.low > case.robot[:, tables.TENSION_MIN]).any()
    np.testing.assert_allclose(cables.sag_force, 4.9 * cables.density * cables.chord, rtol=1e-14)


def test_loss_of_rank_is_reported() -> None:
    case = random_case(np.random.default_rng(6), 8)
    case.robot[:, 3:6] = case.body[tables.CENTER_X :]  # all cables through the center of mass
    assert setting(case).status == POSE_SINGULAR
    assert setting(case._replace(freedom=A_POINT)).status == POSE_SOLVED


def test_a_cable_with_coincident_ends_has_no_chord() -> None:
    for short in (0.0, 0.9e-9, 1.1e-9):
        case = random_case(np.random.default_rng(7), 8)
        case.pose[:] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
        case.robot[5, :3] = case.robot[5, 3:6]
        case.robot[5, 2], case.robot[5, 5] = short, 0.0
        assert (setting(case).status == POSE_NO_CHORD) == (short < 1e-9)
