"""Dynamic stiffness of the cables of a robot: at rest, compared with component modes, with damping."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import sagline as sl
from sagline.dynamics.vibration.component_modes import CableComponents
from sagline.dynamics.vibration.dynamic_stiffness import _in_world
from sagline.dynamics.vibration.robot_modes import VibrationModel
from tests.dynamics.states import middle
from tests.kernels.dynamics.strings import added, chain, string
from tests.kinematics.feasible import by_tier
from tests.refusal import refused
from tests.tiers import wide


@pytest.mark.parametrize("name", by_tier(sl.robot_names()))
def test_at_rest_it_is_the_static_stiffness(name: str) -> None:
    """By the closed form, and by the integral of C including the routing after the frame ends."""
    state = middle(name)
    static = sl.stiffness(state).cable_stiffness
    size = np.abs(static).max(axis=(1, 2))[:, None, None]
    assert (np.abs(sl.dynamic_stiffness(state, 0.0) - static) <= 1e-11 * size).all()
    components = CableComponents(VibrationModel(state).strings, 0, 0.1)
    points = components.points
    last = np.array([one[np.flatnonzero(~np.isnan(one[:, 0]))[-1]] for one in points])
    xx, xz, zz, yy = last[:, 2:].T
    determinant = xx * zz - xz**2
    inverse = np.stack((zz / determinant, -xz / determinant, xx / determinant, 1.0 / yy), axis=-1)
    summed = _in_world(inverse[None], components.axes)[0]
    assert (np.abs(summed - static) <= 1e-11 * size).all()


def test_two_thousand_extreme_cables_at_rest() -> None:
    """The difference near zero frequency is the moving mass only, without the rounding of the inversion of C."""
    random = np.random.default_rng(1)
    count = 2000
    weight = 10.0 ** random.uniform(-2, 3, count)
    tables = np.concatenate(
        [
            string(
                w * 10.0 ** random.uniform(-4, 3),
                w * random.uniform(-2, 3),
                10.0 ** random.uniform(-1, 2),
                0.0,
                w * 10.0 ** random.uniform(0, 5),
            )
            for w in weight
        ]
    )
    tables[:, 3] = weight / tables[:, 2]
    tables[:, 5] = tables[:, 3] / 9.81
    found = added(tables, 1e-7)[0]
    size = np.abs(found).max(axis=1)
    closed = tables[:, 4] / tables[:, 2]
    assert np.isfinite(found).all()
    assert (size <= 1e-8 * closed).all()


@pytest.mark.parametrize("name", wide(["cogiro", "article-suspended", "expo2015-lucia", "ipanema-2-pulleys"], first=3))
def test_component_modes_agree_with_the_exact_stiffness(name: str) -> None:
    state = middle(name)
    components = CableComponents(VibrationModel(state).strings, 0, 80.0)
    static = sl.stiffness(state).cable_stiffness
    for frequency in (1.0, 8.0, 16.0, 19.5):  # no frequency near that of a cable, which would magnify rounding
        exact = sl.dynamic_stiffness(state, frequency).real - static
        size = np.abs(exact).max(axis=(1, 2))[:, None, None] + np.abs(static).max(axis=(1, 2))[:, None, None]
        assert (np.abs(_of_modes(components, 2.0 * np.pi * frequency) - exact) <= 1e-8 * size).all()


def _of_modes(components: CableComponents, omega: float) -> np.ndarray:
    moving = -(omega**2) * components.still
    shares = omega**4 / (components.square - omega**2)
    terms = components.participation[:, :, None] * components.participation[:, None, :] * shares[:, None, None]
    np.add.at(moving, components.cable, -terms)
    return moving


def test_it_is_symmetric_and_real_without_damping() -> None:
    found = sl.dynamic_stiffness(middle("cogiro"), [0.0, 3.0, 30.0])
    assert found.shape == (3, 8, 3, 3)
    assert np.abs(found - np.swapaxes(found, -1, -2)).max() <= 1e-9 * np.abs(found).max()
    assert not found.imag.any()


def test_damping_dissipates_energy() -> None:
    """The imaginary part, force in phase with velocity, is positive definite and grows from zero as documented."""
    state = middle("cogiro")
    for damping in (sl.Damping(loss_time=1e-4), sl.Damping(air_damping=0.02), sl.Damping(modal_damping=0.01)):
        found = sl.dynamic_stiffness(state, [0.5, 3.0, 12.0], damping)
        lost = np.linalg.eigvalsh(found.imag)
        assert (lost >= -1e-9 * np.abs(found).max()).all()
        assert (lost[..., -1] > 0.0).all()
    static = sl.stiffness(state).cable_stiffness
    whole = sl.dynamic_stiffness(state, 1e-5, sl.Damping(modal_damping=0.01))
    assert whole == pytest.approx((1.0 + 0.02j) * static, rel=1e-6, abs=1e-6)


def test_damped_cables_agree_with_finite_elements() -> None:
    """A sagging cable with losses of stretch and air as a chain with dashpots, extrapolated."""
    from tests.kernels.dynamics.test_collocation import CABLES

    table, omega, eta, drag = CABLES["sagging"], 2.0 * np.pi * 0.8, 3e-3, 0.05
    ends = np.array([chain(table, n).end(omega, eta, drag) - chain(table, n).end(0.0) for n in (80, 160, 320)])
    once = (4.0 * ends[1:] - ends[:-1]) / 3.0
    expected = (16.0 * once[1] - once[0]) / 15.0
    found = added(table, omega / (2.0 * np.pi), damping=sl.Damping(eta, drag))[0, 0]
    assert found == pytest.approx(expected, abs=1e-6 * np.abs(found).max())


@pytest.mark.parametrize("frequency", [-1.0, np.nan, [[1.0]], 1e15])
def test_invalid_frequencies(frequency: object) -> None:
    with pytest.raises(sl.InvalidValueError, match="frequency"):
        sl.dynamic_stiffness(middle("cogiro"), frequency)  # type: ignore[call-overload]


def test_a_pose_that_is_not_feasible_has_no_dynamics() -> None:
    """All functions of a single state refuse it; `vibration` has a status for it."""
    state = sl.inverse(sl.load_robot("cogiro"), sl.Pose((0, 0, 40), np.eye(3))).state
    calls: tuple[tuple[Callable[[sl.Equilibrium], object], str], ...] = (
        (sl.frequency_slopes, "a state without lengths"),
        (sl.linearized, "a state without lengths or stiffness"),
        (lambda state: sl.dynamic_stiffness(state, 1.0), "a state without lengths"),
        (lambda state: sl.frequency_response(state, [1.0]), "a state without lengths"),
    )
    for of, value in calls:
        with refused("state", value, "a state that was solved", kind=sl.InvalidValueError):
            of(state)


def test_shallow_models_are_refused() -> None:
    robot = sl.load_robot("cogiro")
    state = sl.inverse(robot, sl.Pose((0, 0, 2), np.eye(3)), sl.Parabolic()).state
    with pytest.raises(sl.InvalidValueError, match="Catenary"):
        sl.dynamic_stiffness(state, 1.0)
