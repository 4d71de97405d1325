"""Modes of robots with cable mass compared with stored finite elements, the exact count, and complex roots."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.integrate import simpson

import sagline as sl
from sagline.dynamics.vibration.dynamic_stiffness import EXACT, _in_world
from sagline.dynamics.vibration.robot_modes import VibrationModel, _dynamic_matrix
from sagline.kernels.dynamics import collocation
from tests.dynamics.linear_systems import mass_of
from tests.dynamics.states import at, middle
from tests.refusal import refused
from tests.tiers import wide

# [Hz], by finite elements of the whole robot with cable mass, which agree to 3e-7
LOWEST_SIX = {
    (0.0, 0.0, 1.5): (1.77012, 1.94887, 2.17070, 2.19814, 2.24366, 2.24810),
    (3.0, 2.0, 1.5): (1.32058, 1.32629, 1.36270, 1.41008, 1.75574, 1.82122),
}


@pytest.mark.parametrize("position", LOWEST_SIX)
def test_lowest_six_of_article_suspended_by_finite_elements(position: tuple[float, float, float]) -> None:
    found = sl.vibration(at("article-suspended", position), up_to=3.0)
    assert found.complete
    assert found.frequency[:6] == pytest.approx(LOWEST_SIX[position], abs=1e-5)
    if position[0] == 0.0:
        assert found.massless_frequency[:3] == pytest.approx((1.787, 2.177, 2.961), abs=5e-4)


@pytest.mark.parametrize("name", wide(["cogiro", "article-suspended", "fast", "ipanema-2-pulleys"], first=3))
def test_every_frequency_by_the_exact_count(name: str) -> None:
    """k - 1 modes are below f - 1e-5 Hz, and k modes below f + 1e-5 Hz: all are exact, none is missed."""
    state = middle(name)
    up_to = 0.5 if name == "fast" else 10.0
    found, setting = sl.vibration(state, up_to=up_to), VibrationModel(state)
    assert found.complete
    for number, frequency in enumerate(found.frequency):
        twins = int((np.abs(found.frequency - frequency) < 2e-5).sum()) - 1
        below, above = (setting.modes_below(0, frequency + step) for step in (-1e-5, 1e-5))
        assert below <= number < above
        assert above - below <= 1 + twins


def test_the_count_at_frequencies_to_fifty_hertz() -> None:
    state = middle("cogiro")
    setting, found = VibrationModel(state), sl.vibration(state, up_to=50.0)
    assert found.complete
    for frequency in (2.0, 4.1, 11.3, 20.0, 33.3, 49.9):
        assert (found.frequency < frequency).sum() == setting.modes_below(0, frequency)


def test_lowest_twelve_of_cogiro_do_not_depend_on_the_number_of_elements() -> None:
    state = at("cogiro", (0.0, 0.0, 2.0))
    few, many = sl.vibration(state, up_to=20.0), sl.vibration(state, up_to=80.0)
    assert few.frequency[:12] == pytest.approx(many.frequency[:12], abs=5e-6)
    assert few.frequency == pytest.approx(many.frequency[: few.count], abs=1e-5)


@pytest.mark.parametrize("name", wide(["cogiro", "ipanema-2-pulleys"]))
def test_shapes_have_the_stated_energy(name: str) -> None:
    """Unit modal mass: of the platform by its mass matrix, of each cable by quadrature over its shape."""
    state = middle(name)
    found = sl.vibration(state, up_to=9.0)
    own = np.einsum("ak,ab,bk->k", found.shape, mass_of(state), found.shape)
    assert own == pytest.approx(found.platform_share, abs=1e-12)
    assert found.platform_share + found.cable_share.sum(axis=0) == pytest.approx(1.0, abs=1e-12)
    cables = state.cables
    points = found.cable_shape.shape[2]
    energy = simpson((found.cable_shape**2).sum(axis=-1), dx=1.0 / (points - 1), axis=2)
    energy *= state.one_robot.cables.linear_density * cables.unstrained_length
    assert pytest.approx(found.cable_share, abs=3e-6) == energy.T
    ends = VibrationModel(state).ends[0] @ found.shape
    assert np.moveaxis(found.cable_shape[:, :, -1], 0, -1) == pytest.approx(ends, abs=1e-12)


@pytest.mark.parametrize("name", wide(["cogiro", "ipanema-2-pulleys"]))
def test_losses_agree_with_roots_in_the_complex_plane(name: str) -> None:
    """D(omega) u = 0 at omega (i zeta + sqrt(1 - zeta^2)) to first order: the shift is proportional to the damping."""
    state = middle(name)
    for damping in (sl.Damping(loss_time=2e-6), sl.Damping(air_damping=2e-5)):
        found = sl.vibration(state, up_to=7.0, damping=damping)
        for k in np.argsort(-found.platform_share)[:3]:
            omega = 2.0 * np.pi * found.frequency[k]
            root = _root(state, damping, complex(omega, omega * found.loss[k]))
            assert root.imag / abs(root) == pytest.approx(found.loss[k], rel=2e-3)
    plain = sl.vibration(state, up_to=7.0, damping=sl.Damping(modal_damping=0.01))
    assert (plain.loss == 0.01).all()


def _root(state: sl.Equilibrium, damping: sl.Damping, omega: complex) -> complex:
    """Root of det D near a complex frequency, by the secant method."""
    setting = VibrationModel(state)
    static = np.abs(np.linalg.det(_dynamic_matrix(setting, 0, np.zeros((8, 3, 3)), 0.0)))

    def determinant(at: complex) -> complex:
        waves = np.zeros((1, 1, collocation.WAVE_COLUMNS), dtype=np.complex128)
        stretch = 1.0 / (1.0 + 1j * at * damping.loss_time)
        waves[0, 0] = at.real, at**2, 1j * at * damping.air_damping, 1.0, stretch
        found = np.empty((1, 1, 8, collocation.FOUND), dtype=np.complex128)
        counts = np.empty((1, 1, 8, 2), dtype=np.int64)
        room = np.empty(collocation.ROOM, dtype=np.complex128)
        collocation.dynamic_stiffnesses(setting.strings.table, waves, EXACT, room, found, counts)
        moving = _in_world(found[0], setting.strings.axes[0])[0]
        whole = np.einsum("mai,mab,mbj->ij", setting.ends[0], moving, setting.ends[0])
        whole += setting.stiffness[0] - at**2 * setting.mass[0]
        return complex(np.linalg.det(whole) / static)

    one, other = omega, omega * (1.0 + 1e-7)
    value, last = determinant(one), determinant(other)
    for _ in range(30):
        step = value * (one - other) / (value - last)
        one, other, last = one - step, one, value
        value = determinant(one)
        if abs(step) < 1e-13 * abs(one):
            break
    return one


def test_a_platform_on_weightless_cables_agrees_with_modes() -> None:
    """Very light cables have very high frequencies; the modes of the platform are the massless ones."""
    robot = sl.load_robot("cogiro")
    light = robot.replace(cables=sl.Cable(1e-7 * np.ones(8), robot.cables.axial_stiffness))
    state = sl.inverse(light, sl.Pose((0.5, 0.3, 2.0), np.eye(3)), tension=sl.MinimumNorm()).state
    found = sl.vibration(state, up_to=30.0)
    assert found.complete
    assert found.frequency == pytest.approx(sl.modes(state).frequency, rel=1e-5)
    assert found.platform_share == pytest.approx(1.0, abs=1e-5)


def test_elastic_cables_without_weight_vibrate() -> None:
    robot = sl.load_robot("cogiro")
    state = sl.inverse(robot, sl.Pose((0.5, 0.3, 2.0), np.eye(3)), sl.Elastic()).state
    found, setting = sl.vibration(state, up_to=12.0), VibrationModel(state)
    assert found.complete
    assert found.count > 16
    assert setting.modes_below(0, 12.0) == found.count


def test_a_mode_at_the_limit_agrees_with_the_count() -> None:
    state = middle("cogiro")
    frequency = sl.vibration(state, up_to=10.0).frequency[5]
    for up_to in (frequency, frequency * (1.0 - 1e-9), frequency * (1.0 + 1e-9)):
        assert sl.vibration(state, up_to=up_to).complete


def test_an_unstable_equilibrium_has_directions_and_no_frequencies() -> None:
    robot = sl.load_robot("cogiro")
    high = robot.replace(platform_anchors=0.02 * robot.platform_anchors, center_of_mass=[0.0, 0.0, 2.0])
    state = sl.inverse(high, sl.Pose((0.0, 0.0, 2.0), np.eye(3))).state
    assert np.isfinite(state.unstrained_length).all()
    found = sl.vibration(state, up_to=5.0)
    assert found.status is sl.VibrationStatus.UNSTABLE
    assert found.frequency.size == 0
    assert not found.complete
    assert found.negative_directions.shape[1] > 0
    motion = found.negative_directions
    work = np.einsum("ak,ab,bk->k", motion, sl.stiffness(state).matrix, motion)
    assert (work < 0.0).all()


@pytest.mark.parametrize("yaw", [0.0, 0.3, 1.0, 2.0])
@pytest.mark.parametrize("density", [1e-6, 0.01, 1.0])
def test_an_unconstrained_motion_has_zero_frequency(yaw: float, density: float) -> None:
    rope = sl.Cable(linear_density=density, axial_stiffness=1e5)
    robot = sl.Robot("p", [[0, 0, 12.0]], [[0, 0, 0.5]], rope, mass=100.0, inertia=np.diag([5.0, 6.0, 7.0]))
    state = sl.forward(robot, [10.0], start=sl.Pose.from_euler([0, 0, 1.4], 0, 0, yaw)).state
    assert sl.modes(state).frequency[0] == 0.0
    found = sl.vibration(state, up_to=30.0)
    assert found.frequency[0] == found.massless_frequency[0] == 0.0
    assert found.complete
    assert found.frequency[1] > 0.1  # of the pendulum


def test_an_unstable_equilibrium_has_no_frequency_response() -> None:
    robot = sl.load_robot("article-suspended").replace(center_of_mass=(0.0, 0.0, 5.0))
    state = sl.inverse(robot, sl.Pose([0.0, 0.0, 1.5], np.eye(3))).state
    with refused("state", "an unstable equilibrium"):
        sl.frequency_response(state, [1.0])
    with refused("modes", "of an unstable state"):
        sl.to_shape(sl.modes(state), sl.quintic_path([(0, 0, 1.5), (1, 0, 1.5)], durations=2.0))


def test_a_slack_cable_is_named_and_the_others_vibrate() -> None:
    """One cable is far too long and folded, and the robot vibrates on the other seven."""
    robot = sl.load_robot("cogiro")
    state = sl.inverse(robot, sl.Pose((0.0, 0.0, 2.0), np.eye(3)), sl.Elastic()).state
    lengths = np.array(state.unstrained_length)
    lengths[3] += 1.0
    slack = sl.forward(robot, lengths, start=state.pose, model=sl.Elastic()).state
    found = sl.vibration(slack, up_to=8.0)
    assert found.slack_cables
    assert 3 in found.slack_cables
    assert found.status is sl.VibrationStatus.FOLDED
    assert "slack_cables" in found.status.text
    assert not found.complete
    assert found.count == found.frequency.size > 0
    assert (found.cable_share[list(found.slack_cables)] == 0.0).all()
    assert not found.cable_shape[:, list(found.slack_cables)].any()
    assert np.isnan(sl.dynamic_stiffness(slack, 3.0)[3]).all()


def test_an_infeasible_pose() -> None:
    plan = sl.inverse(sl.load_robot("cogiro"), sl.Pose((0.0, 0.0, 50.0), np.eye(3)))
    found = sl.vibration(plan.state, up_to=5.0)
    assert found.status is sl.VibrationStatus.NO_LENGTHS
    assert found.frequency.size == found.count == 0


@pytest.mark.parametrize("up_to", [0.0, -1.0, np.nan, np.inf, 1e-60, "ten", 1e14])
def test_invalid_limits(up_to: object) -> None:
    with pytest.raises(sl.InvalidValueError):
        sl.vibration(middle("cogiro"), up_to=up_to)  # type: ignore[call-overload]


def test_too_many_modes_are_counted_and_refused() -> None:
    with refused("up_to", kind=sl.InvalidValueError) as caught:
        sl.vibration(middle("cogiro"), up_to=900.0)
    assert re.search(r"^900 Hz, .* 3,\d\d\d modes$", caught.value.value)


def test_modes_and_count_that_disagree_are_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(VibrationModel, "modes_below", lambda *_: 79)
    with pytest.raises(sl.SaglineError, match=r"\b79\b"):
        sl.vibration(middle("cogiro"), up_to=10.0)


@pytest.mark.parametrize("name", ["cogiro", "article-prototype", "expo2015-lucia"])
def test_modes_above_the_first_string_frequency_are_marked(name: str) -> None:
    """By bisection of the count of all cables."""
    state = middle(name)
    found = sl.modes(state)
    assert found.above_strings.tolist() == (found.frequency > _first_string(state)).tolist()
    batch = sl.inverse(state.one_robot, sl.Pose(np.stack([state.pose.position] * 2), np.stack([np.eye(3)] * 2)))
    assert sl.modes(batch.state).above_strings.shape == (2, 6)


def _first_string(state: sl.Equilibrium) -> float:
    from tests.kernels.dynamics.strings import held

    table = VibrationModel(state).strings.table[0]
    return min(held(table[i : i + 1], 1, plane, 1e-6) for i in range(len(table)) for plane in (0, 1))


@pytest.mark.parametrize("name", ["cogiro", "article-suspended"])
def test_far_too_many_modes_are_refused_before_they_are_counted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(VibrationModel, "modes_below", None)
    robot = sl.load_robot(name)
    state = sl.inverse(robot, sl.Pose.from_euler((0.5, 0.3, 2.0), 0.0, 0.0, 0.0)).state
    cables = state.cables
    wave = cables.unstrained_length * np.sqrt(robot.cables.linear_density / cables.chord_tension)
    for up_to in (5e3, 1e6):
        with refused("up_to", kind=sl.InvalidValueError) as caught:
            sl.vibration(state, up_to=up_to)
        count = float(caught.value.value.split("about ")[1].split(" modes")[0].replace(",", ""))
        assert count == pytest.approx(4.0 * up_to * wave.sum(), rel=0.02)
