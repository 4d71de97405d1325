"""Figures of vibrations and simulations show the correct numbers."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import LineCollection, QuadMesh
from matplotlib.figure import Figure
from PIL import Image
from scipy.spatial.transform import Rotation
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline import Damping, VibrationStatus, plot
from sagline.dynamics.vibration.vibration import ListedMode
from sagline.plot.dynamics import _energy_shares
from tests.plot import made
from tests.refusal import refused
from tests.tiers import extended

FREQUENCY = np.array([1.5, 2.2, 2.9, 4.0])
SHARE = np.array([1.0, 0.25, 0.5, 0.0])
DIRECTIONS = "x, y, z, about x, about y, about z"


def test_the_response_on_light_cables_is_that_of_a_platform_on_springs(snapshot: SnapshotAssertion) -> None:
    light = made.ROBOT.replace(cables=made.ROBOT.cables.replace(linear_density=1e-6))
    state = sl.inverse(light, sl.Pose([1.0, 0.5, 1.5], np.eye(3)), tension=sl.MinimumNorm()).state
    found = sl.modes(state)
    own = made.vibration(state, found.frequency, np.ones(6), Damping(modal_damping=0.02), up_to=20.0)
    ax = plot.response(own, "y")
    with_mass, massless = ax.get_lines()[:2]
    assert (with_mass.get_label(), massless.get_label()) == snapshot
    np.testing.assert_allclose(np.asarray(with_mass.get_ydata()), np.asarray(massless.get_ydata()), rtol=1e-3)
    frequency = np.asarray(with_mass.get_xdata())
    # modal damping is a loss factor of the stiffness, twice as large; the inverse of the whole matrix, not a sum
    mass = np.linalg.inv(found.shape @ found.shape.T)
    square = mass @ found.shape @ np.diag((2.0 * np.pi * found.frequency) ** 2) @ found.shape.T @ mass
    for k in (0, 200, 500, frequency.size - 1):
        answer = np.linalg.inv((1.0 + 0.04j) * square - (2.0 * np.pi * frequency[k]) ** 2 * mass)
        assert np.asarray(massless.get_ydata())[k] == pytest.approx(abs(answer[1, 1]), rel=1e-6)
    assert ax.get_ylabel().replace("\n", " ") == snapshot
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    assert ax.get_title(loc="right") == "modal damping 2 %"


def test_the_response_includes_losses_that_couple_modes() -> None:
    """Exact stiffness of platform and cables: sums over modes are wrong by a factor of 8 in places."""
    state, losses = made.state_at(2.0, 1.0), Damping(loss_time=1e-3, air_damping=0.01)
    with_mass = plot.response(sl.vibration(state, up_to=8.0, damping=losses), "z").get_lines()[0]
    frequency, answer = np.asarray(with_mass.get_xdata()), np.asarray(with_mass.get_ydata())
    some = np.arange(0, frequency.size, frequency.size // 12)
    moving = sl.dynamic_stiffness(state, frequency[some], losses) - sl.stiffness(state).cable_stiffness
    robot, modes = state.one_robot, sl.modes(state)
    mass = np.linalg.inv(modes.shape @ modes.shape.T)
    levers = state.pose.transform(robot.platform_anchors) - state.pose.transform(robot.center_of_mass)
    ends = np.concatenate(
        (np.broadcast_to(np.eye(3), (8, 3, 3)), np.cross(np.eye(3), levers[:, None]).swapaxes(1, 2)), 2
    )
    for k, cables in zip(some, moving, strict=True):
        whole = np.linalg.inv(sl.stiffness(state).compliance) + (ends.swapaxes(1, 2) @ cables @ ends).sum(axis=0)
        exact = np.linalg.inv(whole - (2.0 * np.pi * frequency[k]) ** 2 * mass)
        assert answer[k] == pytest.approx(abs(exact[2, 2]), rel=1e-3)


def test_the_response_below_all_modes_is_the_compliance(snapshot: SnapshotAssertion) -> None:
    state = made.state_at(2.0, 1.0)
    ax = plot.response(made.vibration(state, FREQUENCY, SHARE), "x", "about z")
    static = abs(sl.stiffness(state).compliance[5, 0])
    assert np.asarray(ax.get_lines()[0].get_ydata())[0] == pytest.approx(static, rel=0.1)
    assert ax.get_ylabel().replace("\n", " ") == snapshot
    marks = [np.asarray(line.get_xdata())[0] for line in ax.get_lines()[2:]]
    np.testing.assert_array_equal(marks, FREQUENCY)


def test_the_loss_in_the_stretch_damps_the_massless_robot_too() -> None:
    """Taut cables store the elastic energy of the stiffest mode as stretch: half of the loss factor."""
    light = made.ROBOT.replace(cables=made.ROBOT.cables.replace(linear_density=1e-6))
    state = sl.inverse(light, sl.Pose([1.0, 0.5, 1.5], np.eye(3))).state
    found = sl.modes(state)
    eta = 1e-3
    ax = plot.response(made.vibration(state, found.frequency, np.ones(6), Damping(loss_time=eta)), "z")
    massless = ax.get_lines()[1]
    frequency, answer = np.asarray(massless.get_xdata()), np.asarray(massless.get_ydata())
    # K(EA (1 + i omega eta)) of straight springs: the geometric stiffness is unchanged
    geometric = sl.stiffness(state).matrix - _elastic(state)
    mass = np.linalg.inv(found.shape @ found.shape.T)
    k = int(np.argmin(np.abs(frequency - found.frequency[np.argmax(np.abs(found.shape[2]))])))
    omega = 2.0 * np.pi * frequency[k]
    exact = np.linalg.inv(geometric + (1.0 + 1j * omega * eta) * _elastic(state) - omega**2 * mass)
    assert answer[k] == pytest.approx(abs(exact[2, 2]), rel=0.01)


def _elastic(state: sl.Equilibrium) -> np.ndarray:
    robot = state.one_robot
    lever = state.pose.transform(robot.platform_anchors) - state.pose.transform(robot.center_of_mass)
    along = state.pose.transform(robot.platform_anchors) - robot.frame_anchors
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    row = np.hstack((along, np.cross(lever, along)))
    return np.asarray(row.T @ np.diag(robot.cables.axial_stiffness / state.unstrained_length) @ row)


def test_the_response_with_cable_mass_is_that_of_the_exact_stiffness_of_the_cables() -> None:
    """To the width of a line: omitted modes are quasi-static, and damping ratios apply to modes only."""
    state, damping = made.state_at(3.0, 2.0), Damping(modal_damping=0.01)
    ax = plot.response(sl.vibration(state, up_to=8.0, damping=damping), "x")
    frequency, answer = (np.asarray(each)[::150] for each in ax.get_lines()[0].get_data())
    exact = sl.frequency_response(state, frequency, damping).compliance[:, 0, 0]
    np.testing.assert_allclose(answer, np.abs(exact), rtol=0.02)


def test_results_of_frequency_response_are_drawn_at_their_frequencies(snapshot: SnapshotAssertion) -> None:
    state, damping = made.state_at(3.0, 2.0), Damping(modal_damping=0.02, loss_time=1e-4)
    frequency = np.concatenate(([0.0], np.geomspace(8.0, 0.5, 40)))  # in any order, and at zero frequency
    found = sl.frequency_response(state, frequency, damping)
    ax = plot.response(found, "about y", "x")
    for line, answer in zip(ax.get_lines(), (found.compliance, found.massless_compliance), strict=True):
        np.testing.assert_array_equal(line.get_xdata(), frequency[:0:-1])
        np.testing.assert_allclose(np.asarray(line.get_ydata()), np.abs(answer[:0:-1, 0, 4]), rtol=1e-15)
    assert [line.get_label() for line in ax.get_lines()] == snapshot
    assert [ax.get_ylabel().replace("\n", " "), ax.get_title(loc="right")] == snapshot
    with refused("frequency", "1 of them above 0 Hz", "at least two", kind=sl.InvalidValueError):
        plot.response(sl.frequency_response(state, [0.0, 2.0]))
    with refused("motion", "'w'", DIRECTIONS, kind=sl.InvalidValueError):
        plot.response(found, "x", "w")


def test_a_response_needs_modes_and_a_motion() -> None:
    state = made.state_at()
    lost = made.vibration(state, FREQUENCY, SHARE, status=VibrationStatus.UNSTABLE)
    with refused("vibration", "UNSTABLE", kind=sl.InvalidValueError):
        plot.response(lost)
    with refused("vibration", kind=sl.InvalidValueError):
        plot.response(made.vibration(state, FREQUENCY[:0], SHARE[:0]))
    with refused("force", "'w'", DIRECTIONS, kind=sl.InvalidValueError):
        plot.response(made.vibration(state, FREQUENCY, SHARE), "w")


def test_undamped_peaks_are_cut_and_stated(snapshot: SnapshotAssertion) -> None:
    state = made.state_at()
    ax = plot.response(made.vibration(state, FREQUENCY, SHARE, Damping()))
    assert ax.get_title(loc="right") == snapshot
    assert ax.get_ylim()[1] <= 300.0 * sl.stiffness(state).compliance[0, 0]


def test_line_widths_of_frequencies_are_shares_of_the_platform(snapshot: SnapshotAssertion) -> None:
    clock = np.array([0.0, 0.5, 2.0])
    states = [
        made.vibration(made.state_at(x), FREQUENCY[: 4 - (k == 1)] + 0.1 * k, (SHARE + 0.1 * k)[: 4 - (k == 1)] / 1.2)
        for k, x in enumerate((0.0, 0.5, 1.0))
    ]
    ax = plot.frequencies(states, clock)
    (lines,) = (drawn for drawn in ax.collections if isinstance(drawn, LineCollection))
    segments = np.array(lines.get_segments())
    assert segments.shape == (6, 2, 2)  # the fourth mode of the second state is outside of the range
    np.testing.assert_allclose(segments[0], [(0.0, 1.5), (0.5, 1.6)], rtol=1e-12)
    np.testing.assert_allclose(segments[5], [(0.5, 3.0), (2.0, 3.1)], rtol=1e-12)
    shares = np.array([(SHARE[k] + 0.05 + 0.1 * j) / 1.2 for j in (0, 1) for k in range(3)])
    np.testing.assert_allclose(np.asarray(lines.get_linewidth()), 0.6 + 3.0 * shares, rtol=1e-12)
    dashed = np.array([line.get_ydata() for line in ax.get_lines()])
    np.testing.assert_array_equal(dashed.T, [sl.modes(each.state).frequency for each in states])
    legend = ax.get_legend()
    assert legend is not None
    words = [text.get_text() for text in legend.get_texts()]
    assert [words[0], words[-1]] == snapshot
    assert ax.get_xlabel() == "time [s]"
    assert plot.frequencies(states).get_xlabel() == "state"


def test_frequencies_need_two_states_and_their_times() -> None:
    one = made.vibration(made.state_at(), FREQUENCY, SHARE)
    with refused("vibrations", "1 of them", kind=sl.InvalidValueError):
        plot.frequencies([one])
    with refused("time", kind=sl.InvalidValueError):
        plot.frequencies([one, one], [1.0, 0.0])
    with refused("vibrations[1]", kind=sl.InvalidValueError):
        plot.frequencies([one, 3.0])  # type: ignore[list-item]


def test_the_energy_of_a_simulation_and_the_error_of_its_balance() -> None:
    swinging = made.simulation()
    above, below = plot.energy(swinging).axes
    balance = swinging.energy
    drawn = [line.get_ydata() for line in above.get_lines() if not str(line.get_label()).startswith("_")]
    expected = (
        balance.kinetic,
        balance.potential - balance.potential[0],
        balance.supplied,
        balance.lost,
        balance.removed,
    )
    np.testing.assert_array_equal(drawn, expected)
    np.testing.assert_array_equal(below.get_lines()[0].get_ydata(), balance.error)
    assert [text.get_text().split() for text in above.texts] == [["break", "of", "cable", "3"]]
    np.testing.assert_array_equal(above.get_lines()[-1].get_xdata(), [1.0, 1.0])
    worst = np.abs(balance.error).max()
    assert below.get_title(loc="left").endswith(f"most {worst:.2g}\u00a0J")
    assert (above.get_ylabel(), below.get_xlabel()) == ("energy [J]", "time [s]")


def test_axes_of_the_caller_are_used() -> None:
    left, right = Figure().subplots(1, 2)
    one = made.vibration(made.state_at(), FREQUENCY, SHARE)
    assert plot.response(one, ax=left) is left
    assert plot.frequencies([one, one], ax=right) is right


def test_a_map_has_values_at_their_poses(snapshot: SnapshotAssertion) -> None:
    x, y, z = np.meshgrid([-1.0, 0.5, 2.0], [0.0, 1.0], [1.5, 2.0], indexing="ij")
    order = np.random.default_rng(4).permutation(x.size)
    poses = sl.Pose(np.stack((x, y, z), axis=-1).reshape(-1, 3)[order], np.eye(3))
    found = sl.frequency_map(made.ROBOT, poses, up_to=4.0)
    figure = plot.frequency_map(found, "peak")
    low, high = figure.axes[:2]
    for ax, height in ((low, 1.5), (high, 2.0)):
        assert ax.get_title() == f"$z$ = {height:g} m"
        (mesh,) = (drawn for drawn in ax.collections if isinstance(drawn, QuadMesh))
        values = np.asarray(mesh.get_array())
        for i, column in enumerate((-1.0, 0.5, 2.0)):
            for j, row in enumerate((0.0, 1.0)):
                k = int(np.flatnonzero(np.all(found.pose.position == (column, row, height), axis=1))[0])
                assert values[j, i] == found.peak[k]
    assert figure.axes[-1].get_xlabel() == snapshot
    with refused("found", "5 poses that fill no grid", kind=sl.InvalidValueError):
        plot.frequency_map(sl.frequency_map(made.ROBOT, poses[:5], up_to=4.0))
    with refused("quantity", "'mode'", kind=sl.InvalidValueError):
        plot.frequency_map(found, "mode")


def test_a_film_names_the_source_of_energy() -> None:
    def noted_text(cable: int | None, share: float) -> str:
        return _energy_shares(ListedMode(1, "with cable mass", 2.0, 1.0 - share, cable, share, 0.01))

    assert re.findall(r"\d+", noted_text(3, 0.25)) == ["75", "3", "25"]
    assert noted_text(3, 0.004) == noted_text(None, 0.004)
    assert re.findall(r"\d+", noted_text(3, 0.004)) == ["100", "1"]


@extended
def test_a_film_lasts_ten_seconds_and_is_a_gif(tmp_path: Path) -> None:
    found = sl.vibration(made.state_at(), up_to=2.0)
    noted_text: list[tuple[int, int]] = []
    plot.film(found, 1, tmp_path / "mode.gif", progress=lambda done, total: noted_text.append((done, total)))
    with Image.open(tmp_path / "mode.gif") as film:
        assert film.n_frames * film.info["duration"] == 10_000  # type: ignore[attr-defined]
    assert noted_text[-1] == (25, 25)
    with refused("number", "99", f"1 to {found.frequency.size}, modes with cable mass", kind=sl.InvalidValueError):
        plot.film(found, 99, tmp_path / "mode.gif")
    with refused(kind=sl.FileError, file=tmp_path / "mode.mp4", next_step="Name it .gif."):
        plot.film(found, 1, tmp_path / "mode.mp4")


def test_a_simulation_shows_tensions_and_the_motion_from_the_first_pose() -> None:
    swinging = made.simulation()
    above, middle, below = plot.simulation(swinging).axes
    drawn = [line.get_ydata() for line in above.get_lines() if str(line.get_label()).startswith("cable ")]
    np.testing.assert_array_equal(drawn, swinging.tensions.T)
    away = swinging.pose.position - swinging.pose.position[0]
    moved = np.array([line.get_ydata() for line in middle.get_lines()[:3]])
    np.testing.assert_allclose(moved, away.T, atol=1e-15)
    assert [text.get_text().split() for text in above.texts] == [["break", "of", "cable", "3"]]
    assert (above.get_ylabel(), middle.get_ylabel()) == ("tension [N]", "displacement [m]")
    assert (below.get_ylabel(), below.get_xlabel()) == ("rotation [°]", "time [s]")


def test_a_simulation_shows_rotations_about_the_axes_and_the_limit() -> None:
    whole = made.simulation()
    turned = Rotation.from_rotvec(np.outer(np.radians(np.linspace(0.0, 10.0, len(whole.time))), (0.0, 1.0, 0.0)))
    pose = sl.Pose(whole.pose.position, turned)
    highest = float(whole.tensions.max())
    for limit, count in ((1.5 * highest, 1), (3.0 * highest, 0)):
        robot = whole.robot.replace(tension_max=limit)
        above, _, below = plot.simulation(replace(whole, robot=robot, pose=pose)).axes
        x, y, z = (np.asarray(line.get_ydata()) for line in below.get_lines()[:3])
        np.testing.assert_allclose(y, np.linspace(0.0, 10.0, len(whole.time)), atol=1e-9)
        np.testing.assert_allclose([x, z], 0.0, atol=1e-9)
        assert sum(line.get_label() == "tension_max" for line in above.get_lines()) == count
