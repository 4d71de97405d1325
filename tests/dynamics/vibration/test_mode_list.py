"""Modes as a list: names, kinds, shares of parts, and corresponding massless modes."""

import numpy as np
import pytest

import sagline as sl
from sagline import vibration
from sagline.dynamics.vibration.flexibility import end_displacements, quasi_static_displacements, stretch_losses
from sagline.dynamics.vibration.vibration import listed_modes, mode_correlation
from tests.tiers import wide

ROBOT = sl.load_robot("article-suspended")
STATE = sl.inverse(ROBOT, sl.Pose([3.0, 2.0, 1.5], np.eye(3)), tension=sl.MinimumNorm()).state


def test_every_frequency_names_its_robot() -> None:
    found = vibration(STATE, up_to=6.0, damping=sl.Damping(modal_damping=0.02))
    listed = listed_modes(found)
    swinging = [mode for mode in listed if mode.kind == "with cable mass"]
    light = [mode for mode in listed if mode.kind == "massless"]
    assert [mode.frequency for mode in swinging] == found.frequency.tolist()
    assert [mode.frequency for mode in light] == sl.modes(STATE).frequency.tolist()
    assert [mode.name for mode in swinging[:2]] == ["1", "2"]
    assert [mode.name for mode in light] == [f"massless {k}" for k in range(1, 7)]
    for mode in swinging:
        shares = [mode.platform_share, *found.cable_share[:, mode.number - 1]]
        assert mode.swings == ["platform", *(f"cable {i}" for i in range(8))][int(np.argmax(shares))]
        assert mode.loss == pytest.approx(0.02, rel=1e-9)


def test_massless_modes_correspond_to_modes_with_cable_mass() -> None:
    """With a thousandth of the cable mass each massless mode is one mode; with the real mass it is several."""
    cables = ROBOT.cables.replace(linear_density=1e-4 * ROBOT.cables.linear_density)
    light = sl.inverse(ROBOT.replace(cables=cables), STATE.pose, tension=sl.MinimumNorm()).state
    found = vibration(light, up_to=12.0)
    shares = mode_correlation(found)
    which = shares.argmax(axis=1)
    np.testing.assert_allclose(shares.max(axis=1), 1.0, atol=0.02)
    np.testing.assert_allclose(found.frequency[which], sl.modes(light).frequency, rtol=1e-3)
    spread = mode_correlation(vibration(STATE, up_to=12.0))
    assert spread.max(axis=1).min() < 0.9
    assert np.all(spread.sum(axis=1) < 1.0 + 1e-9)


def test_quasi_static_cables_follow_with_constant_lengths() -> None:
    """To first order: half the motion leaves a quarter of the difference from the catenary of the new end."""
    generator = np.random.default_rng(3)
    motion = generator.normal(size=(6, 1)) * 1e-5
    rest = STATE.cables.points(41)
    errors = []
    for share in (1.0, 0.5):
        ends = end_displacements(STATE, share * motion)[..., 0]
        moved = quasi_static_displacements(STATE, ends, 41)
        run = STATE.pose.transform(ROBOT.platform_anchors) + ends - ROBOT.frame_anchors
        span, rise = np.hypot(run[:, 0], run[:, 1]), run[:, 2]
        hung = sl.Catenary().from_length(ROBOT.cables, span, rise, STATE.unstrained_length).points(41)
        old = STATE.pose.transform(ROBOT.platform_anchors) - ROBOT.frame_anchors
        before, after = (each[:, :2] / np.hypot(each[:, :1], each[:, 1:2]) for each in (old, run))
        level = hung[..., :1] * after[:, None] - rest[..., :1] * before[:, None]
        exact = np.concatenate((level, hung[..., 1:] - rest[..., 1:]), axis=-1)
        errors.append(np.abs(moved - exact).max())
    assert errors[0] < 0.02 * np.abs(motion).max()
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)


def test_losses_of_straight_cables_agree_with_a_complex_stiffness() -> None:
    cables = ROBOT.cables.replace(linear_density=1e-6)
    light = sl.inverse(ROBOT.replace(cables=cables), STATE.pose).state
    platform = sl.modes(light)
    ratio = stretch_losses(light, platform, 1e-4)
    moved = end_displacements(light, platform.shape)
    along = light.pose.transform(ROBOT.platform_anchors) - ROBOT.frame_anchors
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    springs = ROBOT.cables.axial_stiffness / light.unstrained_length
    elastic = np.einsum("m,mn->n", springs, np.einsum("mi,min->mn", along, moved) ** 2)
    omega = 2.0 * np.pi * platform.frequency
    np.testing.assert_allclose(ratio, 0.5 * 1e-4 * elastic / omega, rtol=2e-3)  # springs in series with 1/N: T/EA


@pytest.mark.parametrize(
    "winches", wide([None, sl.Winch(dead_cable=6.0), sl.Winch(0.1, dead_cable=3.0, dead_rise=2.0)])
)
def test_massless_cables_agree_with_very_light_ones(winches: sl.Winch | None) -> None:
    """The routing after the exits contributes compliance and losses; soft elastic springs make it visible."""
    cables = ROBOT.cables.replace(linear_density=2e-6, axial_stiffness=2e4)
    light = sl.inverse(ROBOT.replace(cables=cables, winches=winches), STATE.pose, tension=sl.MinimumNorm()).state
    platform = sl.modes(light)
    found = vibration(light, up_to=1.1 * platform.frequency[-1], damping=sl.Damping(loss_time=1e-4))
    which = mode_correlation(found).argmax(axis=1)
    np.testing.assert_allclose(stretch_losses(light, platform, 1e-4), found.loss[which], rtol=1e-5)
    for k in which:
        shape = found.cable_shape[k]
        moved = quasi_static_displacements(
            light, end_displacements(light, found.shape[:, k, None])[..., 0], shape.shape[1]
        )
        np.testing.assert_allclose(moved, shape, atol=2e-4 * np.abs(shape).max())


def test_below_the_lowest_mode_there_is_none() -> None:
    found = vibration(STATE, up_to=0.5)
    assert (found.frequency.size, found.count, found.complete) == (0, 0, True)
    assert found.cable_shape.shape[:2] == (0, 8)
    assert [mode.kind for mode in listed_modes(found)] == ["massless"] * 6
