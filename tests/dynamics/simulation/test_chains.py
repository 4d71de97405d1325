"""Robots on lumped cables with mass in time, compared with exact modes, other steps and massless cables."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.dynamics.simulation.chain_equilibrium import chains_at_rest
from tests.refusal import refused
from tests.tiers import extended, wide


@cache
def preset_at_rest(name: str, x: float, y: float, z: float) -> sl.Equilibrium:
    """A preset at equilibrium."""
    return sl.inverse(sl.load_robot(name), sl.Pose([x, y, z], np.eye(3))).state


def cogiro() -> sl.Equilibrium:
    return preset_at_rest("cogiro", 0.5, 0.3, 2.0)


def over_pulleys() -> sl.Equilibrium:
    return preset_at_rest("ipanema-3-pulleys", -0.3, -0.05, 1.1)


def winched(state: sl.Equilibrium, cable: int, way: float) -> tuple[list[float], list[Array]]:
    """Wind a cable out and in again."""
    there, back = state.unstrained_length.copy(), state.unstrained_length
    there[cable] += way
    return [0.0, 0.2, 0.3, 0.5], [back, there, there, back]


@pytest.mark.parametrize("name", ["cogiro", "ipanema-3-pulleys", "expo2015-lucia"])
def test_chains_converge_to_the_exact_equilibrium_with_second_order(name: str) -> None:
    """Pose and platform-end tensions compared with the exact catenary: errors fall to a quarter as the nodes double."""
    box = sl.load_robot(name).test_box
    assert box is not None
    state = preset_at_rest(name, *np.mean([box.low, box.high], axis=0) + 0.1)
    off = []
    for nodes in (10, 20, 40):
        pose, _, force = chains_at_rest(state, nodes)
        tension = np.linalg.norm(force, axis=1) - state.cables.platform_end_tension
        off.append([np.linalg.norm(pose.position - state.pose.position), np.abs(tension).max()])
    assert np.divide(off[0], off[1]) == pytest.approx(4.0, abs=0.02)
    assert np.divide(off[1], off[2]) == pytest.approx(4.0, abs=0.01)


@extended
@pytest.mark.parametrize("state", [cogiro, over_pulleys])
def test_a_robot_at_rest_stays_at_rest(state: object) -> None:
    here = state()  # type: ignore[operator]
    run = sl.simulate(here, cable_mass="lumped", nodes=10, duration=0.2)
    assert np.ptp(run.pose.position, axis=0).max() < 1e-13
    assert np.abs(run.tensions - run.tensions[0]).max() < 1e-6
    assert run.tensions[0] == pytest.approx(here.cables.frame_end_tension, abs=0.06)
    assert run.nodes is not None
    assert np.ptp(run.nodes, axis=0).max() < 1e-9
    assert run.nodes[0, :, 0] == pytest.approx(here.exit_point, abs=1e-12)
    assert run.nodes[0, :, -1] == pytest.approx(run.pose[0].transform(here.one_robot.platform_anchors), abs=1e-12)
    assert (run.cable_mass, run.events, run.nodes.shape[2]) == ("lumped", (), 11)


def test_nodes_converge_to_the_exact_catenary_with_second_order() -> None:
    """A slack one: cables that are 2 % longer sag by about 0.8 m."""
    robot = sl.Robot(
        "slack",
        frame_anchors=[[-5, 0, 5], [5, 0, 5]],
        platform_anchors=np.zeros((2, 3)),
        cables=sl.Cable(linear_density=1.0, axial_stiffness=1e5),
        mass=2.0,
        motion_pattern="2T",
        plane_normal=[0, 1, 0],
    )
    start = sl.forward(robot, [5.5, 5.5], start=sl.Pose([0.0, 0.0, 3.0], np.eye(3))).state
    off = []
    for nodes in (10, 20):
        _, place, _ = chains_at_rest(start, nodes)
        exact = start.cables.points(nodes + 1)[1]
        below = place[1, 2, ::-1] - start.exit_point[1, 2]
        off.append(np.abs(below - exact[:, 1]).max())
    assert off[0] < 0.02
    assert off[0] / off[1] == pytest.approx(4.0, abs=0.1)


def spectrum_peaks(time: Array, motion: Array, low: float, high: float) -> Array:
    """Frequencies of the peaks of a record in a range [Hz], above 5 % of the largest peak."""
    from scipy.signal import find_peaks

    windowed = (motion - motion.mean()) * np.hanning(len(motion))
    size = np.abs(np.fft.rfft(windowed, 16 * len(motion)))
    frequency = np.fft.rfftfreq(16 * len(motion), time[1] - time[0])
    band = (frequency > low) & (frequency < high)
    places, _ = find_peaks(size[band], height=0.05 * size[band].max())
    peaks: Array = frequency[band][places]
    return peaks


@cache
def pushed(duration: float, nodes: int) -> sl.Simulation:
    """expo2015-lucia after a small impulse, without damping."""
    gust = ([0, 0.02, 0.1, 0.2, 0.21], np.outer([0, 1, 1, 1, 0], [0.3, 0.2, -0.3, 0.1, 0.08, 0.05]))
    return sl.simulate(
        preset_at_rest("expo2015-lucia", -0.6, 0.0, 3.5),
        cable_mass="lumped",
        nodes=nodes,
        duration=duration,
        wrench=gust,
    )


def check_peaks(run: sl.Simulation, duration: float) -> None:
    free = run.time > 0.3
    peaks = spectrum_peaks(run.time[free], run.pose.position[free, 0], 1.9, 3.2)
    state = preset_at_rest("expo2015-lucia", -0.6, 0.0, 3.5)
    exact = sl.vibration(state, up_to=3.2).frequency
    assert exact == pytest.approx([2.011, 2.586, 3.028], abs=5e-4)
    assert peaks == pytest.approx(exact, abs=1.0 / duration)
    massless = sl.modes(state).frequency[:3]
    assert np.abs(peaks - massless).max() > 1.5 / duration


@extended
def test_the_spectrum_shows_the_modes_of_cables_with_mass_and_energy_has_no_trend() -> None:
    run = pushed(20.0, 10)
    check_peaks(run, 20.0)
    moving = run.energy.kinetic.max()
    assert np.abs(run.energy.error).max() < 1e-5 * moving


@pytest.mark.soak
@pytest.mark.parametrize("nodes", [10, 20, 40])
def test_the_spectrum_of_a_minute_shows_the_modes_of_cables_with_mass(nodes: int) -> None:
    run = pushed(60.0, nodes)
    check_peaks(run, 60.0)
    error = np.abs(run.energy.error) / run.energy.kinetic.max()
    assert error.max() < 1e-5
    assert error[-1000:].max() < 2.0 * error[1000:2000].max() + 1e-7


@extended
def test_the_motion_on_light_cables_is_that_on_massless_ones() -> None:
    """With a tenth of the cable mass, a tenth of the difference, for several platforms and loads."""
    off = []
    for density in (1e-3, 1e-4):
        robot = sl.load_robot("article-prototype")
        robot = robot.replace(winches=None, cables=sl.Cable(linear_density=density, axial_stiffness=14e3))
        state = sl.inverse(robot, sl.Pose.from_euler([0.2, 0.3, 1.2], 0.1, 0.05, -0.05)).state
        gust = ([0, 0.02, 0.1, 0.2, 0.21], np.outer([0, 1, 1, 1, 0], [30, 20, -30, 10, 8, 5]))
        given = {"wrench": gust, "duration": 0.5, "unstrained_length": winched(state, 1, 0.01)}
        run = sl.simulate(state, cable_mass="lumped", nodes=4, **given)  # type: ignore[arg-type]
        massless = sl.simulate(state, **given)  # type: ignore[arg-type]
        off.append(np.abs(run.pose.position - massless.pose.position).max())
        turned = (run.pose.rotation * massless.pose.rotation.inv()).magnitude()
        off.append(turned.max())
    assert np.ptp(massless.pose.position, axis=0).max() > 5e-3
    assert off[0] < 1e-4
    assert off[2] < 0.2 * off[0]
    assert off[3] < 0.2 * off[1]


def moved(step: float | None = None) -> sl.Simulation:
    """CoGiRo along a path on which its cables gain and lose nodes."""
    path = sl.quintic_path([(0, 0, 1.5), (2.5, 1.5, 3.0), (0, 0, 1.5)], durations=(2.0, 2.0), rate=500.0)
    return sl.simulate(sl.inverse(sl.load_robot("cogiro"), path), cable_mass="lumped", nodes=10, step=step)


@extended
def test_moving_winches_close_the_balance_of_energy() -> None:
    run = moved()
    cable = np.abs(run.length - run.length[0]).max(axis=0) / (run.length[0] / 10)
    assert (cable > 2.0).sum() >= 4  # nodes were created and merged
    turned_over = np.ptp(run.energy.supplied)
    assert turned_over > 1000.0
    assert np.abs(run.energy.error).max() < 1e-8 * turned_over
    assert np.abs(run.energy.lost).max() < 1e-4 * turned_over  # energy of births and merges
    assert np.abs(moved(0.5 * run.step).energy.error).max() < 0.7 * np.abs(run.energy.error).max()


@extended
def test_a_broken_cable_gives_the_same_tensions_at_half_the_step() -> None:
    """0.4 of l sqrt(rho/EA) compared with 0.2, 20 nodes: the largest tension of any cable after the break."""
    after = []
    for share in (1.0, 0.5):
        run = sl.simulate(cogiro(), cable_mass="lumped", duration=0.5, step=share * 5e-5, events=sl.Break(0, 0.0))
        assert [event.kind for event in run.events] == ["break"]
        assert np.isnan(run.length[-1, 0])
        after.append(run.events[0].tension_after)
    assert after[0] == pytest.approx(after[1], rel=0.002)
    assert after[0] == pytest.approx(1081.0, abs=1.0)  # after 424 N
    assert cogiro().cables.frame_end_tension.max() == pytest.approx(424.0, abs=1.0)


@extended
def test_an_unstable_step_after_a_break_is_reported_with_time_and_cable() -> None:
    element = cogiro().free_length.min() / 20
    longest = 0.85 * element * float(np.sqrt(0.065 / 700e3))
    with refused("step", kind=sl.InvalidValueError) as caught:
        sl.simulate(cogiro(), cable_mass="lumped", duration=2.0, step=longest, events=sl.Break(0, 0.0))
    assert re.search(r"at 0\.\d+ s, .* cable \d", caught.value.value)


@extended
@pytest.mark.parametrize("event", [sl.Drop(20.0, 0.1), sl.PickUp(20.0, 0.1)])
def test_the_effect_of_loads_agrees_with_massless_cables(event: sl.Drop | sl.PickUp) -> None:
    """Before the reflected waves return: the platform falls or rises, and no energy is generated."""
    run = sl.simulate(cogiro(), cable_mass="lumped", duration=0.12, events=event)
    massless = sl.simulate(cogiro(), duration=0.12, events=event)
    way = massless.pose.position[-1, 2] - 2.0
    assert abs(way) > 1e-4
    assert run.pose.position[-1, 2] - run.pose.position[0, 2] == pytest.approx(way, rel=0.05)
    assert np.abs(run.energy.error).max() < 1e-5
    assert run.energy.lost[-1] == pytest.approx(massless.energy.lost[-1], rel=1e-5, abs=1e-9)
    assert run.energy.supplied[-1] == pytest.approx(massless.energy.supplied[-1], rel=1e-5, abs=1e-9)


@extended
def test_changes_of_payload_in_motion_conserve_momentum() -> None:
    """Velocity of the center of mass a step before and after, for a translating and rotating platform."""
    robot = cogiro().one_robot
    step, carried = 5e-5, 0.5 * 0.065 * float(cogiro().free_length.sum()) / 20.0
    given = {"cable_mass": "lumped", "duration": 0.101, "step": step, "record": step}
    swung = {"unstrained_length": winched(cogiro(), 2, 0.05)}
    free = sl.simulate(cogiro(), **given, **swung)  # type: ignore[arg-type]
    for event in (sl.PickUp(30.0, 0.1), sl.Drop(30.0, 0.1)):
        run = sl.simulate(cogiro(), events=event, **given, **swung)  # type: ignore[arg-type]
        k = round(0.1 / step)
        before, after = run.twist[k], run.twist[k + 1]
        assert run.twist[k] == pytest.approx(free.twist[k], abs=1e-12)
        assert np.abs(before).min() > 1e-3
        if isinstance(event, sl.Drop):
            assert after == pytest.approx(before, abs=2e-3)
        else:
            mass = robot.mass + carried
            assert after[:3] == pytest.approx(before[:3] * mass / (mass + 30.0), rel=0.02, abs=2e-3)


@extended
def test_a_brake_stops_the_lengths_of_chains() -> None:
    given = {"duration": 0.3, "unstrained_length": winched(cogiro(), 2, 0.02), "events": sl.Brake(0.1, duration=0.1)}
    run = sl.simulate(cogiro(), cable_mass="lumped", nodes=10, **given)  # type: ignore[arg-type]
    massless = sl.simulate(cogiro(), **given)  # type: ignore[arg-type]
    assert run.length == pytest.approx(massless.length, abs=1e-12)
    assert np.abs(run.energy.error).max() < 1e-4


@extended
def test_winches_with_inertia_close_the_balance_of_energy_on_chains() -> None:
    """With pulleys and dead length, and drums released at other tensions than those of winding."""
    robot = sl.load_robot("article-prototype")
    assert robot.winches is not None
    loops = {"inertia": 0.035, "position_gain": 20.0, "speed_gain": 4e3, "integral_gain": 8e4}
    robot = robot.replace(winches=robot.winches.replace(**loops))
    state = sl.inverse(robot, sl.Pose([0.2, 0.3, 1.2], np.eye(3))).state
    for winches in ("robot", sl.SecondOrder(20.0, 0.7)):
        run = sl.simulate(
            state,
            cable_mass="lumped",
            nodes=10,
            winches=winches,
            unstrained_length=winched(state, 1, 0.02),
        )
        moving = np.ptp(run.energy.supplied)
        assert moving > 1.0
        assert np.abs(run.energy.error).max() < 1e-3 * moving


@extended
def test_damping_and_wind_close_the_balance_too() -> None:
    state = preset_at_rest("expo2015-lucia", -0.6, 0.0, 3.5)
    run = sl.simulate(
        state,
        cable_mass="lumped",
        nodes=10,
        duration=1.0,
        unstrained_length=winched(state, 1, 0.05),
        damping=sl.Damping(loss_time=2e-5, air_damping=0.05),
        wind=([0.0, 0.5, 1.0], np.outer([0, 1, 0], [8.0, 4.0, 0.0])),
    )
    assert run.energy.lost[-1] > 0.01
    assert np.abs(run.energy.error).max() < 1e-3 * run.energy.lost[-1]


@extended
def test_a_steady_wind_acts_with_half_of_its_force_at_the_platform_ends() -> None:
    """Damped to rest; the effect of wind on inclined cables is a tenth of that of their weight."""
    state = preset_at_rest("expo2015-lucia", -0.6, 0.0, 3.5)
    given = {"duration": 2.5, "damping": sl.Damping(loss_time=0.02, air_damping=20.0), "wind": [1.0, 0.0, 0.0]}
    run = sl.simulate(state, cable_mass="lumped", nodes=4, **given)  # type: ignore[arg-type]
    massless = sl.simulate(state, **given)  # type: ignore[arg-type]
    way = massless.pose.position[-1] - massless.pose.position[0]
    assert run.pose.position[-1] - run.pose.position[0] == pytest.approx(way, abs=0.12 * np.abs(way).max())


@pytest.mark.parametrize(
    ("given", "parts"),
    wide(
        [
            ({"nodes": 3}, ("nodes", "3", "4 to 500")),
            ({"nodes": 1000}, ("nodes", "1000", "4 to 500")),
            ({"integrator": "runge-kutta"}, ("integrator", '"runge-kutta"', '"splitting" for cables with mass')),
            ({"step": 1e-3}, ("step", "0.001 s")),
            (
                {"unstrained_length": ([0, 1], [[9.0] * 8, [1.0] * 8]), "duration": 1.0},
                ("cable 0: length", "almost completely wound in at 0.97075 s"),
            ),
        ],
        first=4,
    ),
)
def test_unsupported_options_of_chains_are_refused(given: dict[str, Any], parts: tuple[str, ...]) -> None:
    with refused(*parts) as caught:
        sl.simulate(cogiro(), **{"cable_mass": "lumped", "duration": 0.1, **given})
    assert len(str(caught.value)) < 300


def test_cables_without_weight_or_mass_are_refused() -> None:
    robot = sl.load_robot("cogiro")
    pose = sl.Pose([0.5, 0.3, 2.0], np.eye(3))
    with refused("start: model", "Elastic()", 'Catenary() where cable_mass="lumped"'):
        sl.simulate(sl.inverse(robot, pose, sl.Elastic()).state, cable_mass="lumped", duration=0.1)


def on_a_point(*frame: tuple[float, float, float], lengths: list[float], lever: float = 0.0) -> sl.Equilibrium:
    """A load on cables that meet in a point high above its center of mass: its rotation about the point is free."""
    robot = sl.Robot(
        "load",
        frame_anchors=frame,
        platform_anchors=[[0.0, 0.0, lever]] * len(frame),
        cables=sl.Cable(linear_density=1.0, axial_stiffness=1e5),
        mass=100.0,
        inertia=np.eye(3),
    )
    return sl.forward(robot, lengths).state


@extended
@pytest.mark.parametrize("lever", [0.0, 1e-6, 0.5])
def test_a_pendulum_of_chains_rests_at_its_exact_stretch(lever: float) -> None:
    """The tension of a vertical cable is linear, for which the midpoint rule is exact."""
    state = on_a_point((0, 0, 12.0), lengths=[10.0], lever=lever)
    gravity = state.one_robot.gravity
    run = sl.simulate(state, duration=0.2, cable_mass="lumped", nodes=7)
    stretched = 10.0 * (1.0 + (100.0 + 0.5 * 10.0) * gravity / 1e5)
    np.testing.assert_allclose(run.pose.position, np.tile([0.0, 0.0, 12.0 - stretched - lever], (21, 1)), atol=1e-12)
    assert np.ptp(run.tensions) < 1e-6


@extended
@pytest.mark.parametrize("frame", [[(-4, 0, 7.0), (4, 0, 8.0)], [(-4, 0, 7.0), (4, 0, 8.0), (0, 4, 8.0)]])
def test_chains_to_a_common_point_reach_the_exact_equilibrium(frame: Any) -> None:
    state = on_a_point(*frame, lengths=[6.0, 8.0, 7.0][: len(frame)])
    off = [np.linalg.norm(chains_at_rest(state, nodes)[0].position - state.pose.position) for nodes in (10, 20, 40)]
    assert np.divide(off[:-1], off[1:]) == pytest.approx(4.0, abs=0.05)
    run = sl.simulate(state, duration=0.1, cable_mass="lumped", nodes=10)
    assert np.ptp(run.pose.position, axis=0).max() < 1e-12


def tripod(mass: float) -> sl.Equilibrium:
    """A point mass on three cables."""
    robot = sl.Robot(
        "tripod",
        frame_anchors=[[3, 0, 3], [-2, 2, 3], [-2, -2, 3]],
        platform_anchors=np.zeros((3, 3)),
        cables=sl.Cable(linear_density=0.005, axial_stiffness=5e4),
        mass=mass,
        motion_pattern="3T",
    )
    return sl.inverse(robot, sl.Pose([0.0, 0.0, 1.0], np.eye(3))).state


def in_a_plane() -> sl.Equilibrium:
    """A platform that moves and rotates in the plane of x and z."""
    robot = sl.Robot(
        "planar",
        frame_anchors=[[3, 0, 3], [-3, 0, 3], [3, 0, 0], [-3, 0, 0]],
        platform_anchors=[[0.3, 0, 0.2], [-0.3, 0, 0.2], [0.3, 0, -0.2], [-0.3, 0, -0.2]],
        cables=sl.Cable(linear_density=0.005, axial_stiffness=5e4),
        mass=20.0,
        inertia=np.eye(3),
        motion_pattern="1R2T",
        plane_normal=[0, 1, 0],
        tension_min=50.0,
        tension_max=5000.0,
    )
    return sl.inverse(robot, sl.Pose([0.2, 0.0, 1.4], np.eye(3))).state


@extended
@pytest.mark.parametrize("pattern", ["3T", "1R2T"])
def test_point_and_planar_platforms_move_as_on_massless_cables(pattern: str) -> None:
    """On light cables; the constraint forces of the guides are zero."""
    state = tripod(50.0) if pattern == "3T" else in_a_plane()
    given: dict[str, Any] = {"unstrained_length": winched(state, 0, 0.01)}
    run = sl.simulate(state, cable_mass="lumped", nodes=6, **given)
    massless = sl.simulate(state, **given)
    moved = np.ptp(massless.pose.position, axis=0).max()
    assert moved > 3e-3
    assert np.abs(run.pose.position - massless.pose.position).max() < 0.03 * moved
    turned = (run.pose.rotation * massless.pose.rotation.inv()).magnitude().max()
    assert turned < 0.03 * moved
    held = run.twist[:, 3:] if pattern == "3T" else run.twist[:, [1, 3, 5]]
    assert np.abs(held).max() < 1e-12
    assert np.abs(run.energy.error).max() < 1e-4 * np.ptp(run.energy.supplied)


@extended
def test_a_very_slack_chain_stays_at_rest() -> None:
    """1.5 m too long: it sags far below its chord with a tension of 6 N."""
    robot = sl.load_robot("cogiro")
    start = preset_at_rest("cogiro", 0.0, 0.0, 2.0)
    longer = start.unstrained_length.copy()
    longer[0] += 1.5
    state = sl.forward(robot, longer, start=start.pose).state
    run = sl.simulate(state, cable_mass="lumped", duration=0.1)
    assert state.cables.frame_end_tension[0] < 7.0
    assert run.tensions[0] == pytest.approx(state.cables.frame_end_tension, abs=0.05)
    assert np.ptp(run.pose.position, axis=0).max() < 1e-12


@extended
def test_a_plan_that_begins_in_motion_continues_at_its_speed() -> None:
    path = sl.quintic_path([(0, 0, 1.5), (1.5, 1.0, 2.5)], durations=(2.0,), rate=500.0)
    later = slice(300, None)
    rest = sl.Path(path.time[later], path.pose[later], path.twist[later], path.twist_rate[later])
    plan = sl.inverse(sl.load_robot("cogiro"), rest)
    run = sl.simulate(plan, cable_mass="lumped", nodes=10)
    assert run.time[0] == pytest.approx(0.6)
    assert run.twist[0] == pytest.approx(sl.simulate(plan, duration=0.1).twist[0], abs=1e-12)
    assert np.abs(run.twist[0, :3]).max() > 0.5
    want = np.stack([np.interp(run.time, rest.time, rest.pose.position[:, k]) for k in range(3)], axis=1)
    assert np.abs(run.pose.position - want).max() < 1e-3
    assert np.abs(run.energy.error).max() < 1e-8 * np.ptp(run.energy.supplied)
