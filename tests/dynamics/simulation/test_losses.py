"""Damping of cables: losses compared with cables with mass, and with the recorded tensions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.dynamics.simulation.simulate import Integrator
from tests.dynamics.let_go import LIFT, beside
from tests.tiers import extended

LOSS = sl.Damping(loss_time=1e-3)
PULLEY, DEAD = sl.Winch(0.05), sl.Winch(dead_cable=3.0)


@extended
@pytest.mark.parametrize("behind", [None, PULLEY, DEAD, sl.Winch(0.05, dead_cable=3.0)])
def test_losses_of_massless_cables_agree_with_light_ones_during_winding(behind: sl.Winch) -> None:
    robot = sl.load_robot("article-suspended")
    rope = robot.cables.replace(linear_density=0.1 * robot.cables.linear_density)  # heavy cables lose more in waves
    robot = robot.replace(winches=behind, cables=rope)
    path = sl.septic_path([(0, 0, 1.0), (0, 0, 2.5)], durations=1.5, rate=500.0)
    plan = sl.inverse(robot, path, tension=LIFT)
    massless, lumped = (
        sl.simulate(plan, duration=2.0, damping=LOSS, cable_mass=mass, nodes=10).energy.lost[-1]
        for mass in ("none", "lumped")
    )
    assert massless == pytest.approx(lumped, rel=0.015)


@pytest.mark.parametrize("integrator", ["splitting", "runge-kutta"])
def test_recorded_tensions_include_damping(
    integrator: Integrator,
) -> None:
    robot, step = sl.load_robot("article-suspended"), 1e-4
    state, lengths = beside(robot, (0.5, 0.3, 1.5), np.array([0.004, -0.003, 0.0033]), sl.Elastic())
    run = sl.simulate(
        state, unstrained_length=lengths, duration=0.1, step=step, record=step, damping=LOSS, integrator=integrator
    )
    rotation = run.pose.matrix
    chords = robot.frame_anchors - (run.pose.position[:, None] + robot.platform_anchors @ np.swapaxes(rotation, 1, 2))
    along = chords / np.linalg.norm(chords, axis=2, keepdims=True)
    pulled = np.einsum("nm,nmc->nc", run.tensions, along) - [0.0, 0.0, robot.mass * robot.gravity]
    moved = robot.mass * (run.twist[2:, :3] - run.twist[:-2, :3]) / (2.0 * step)
    off = np.abs(pulled[1:-1] - moved).max()
    assert off < 1e-3


def test_losses_of_cables_with_mass_do_not_limit_the_step() -> None:
    state = sl.inverse(sl.load_robot("cogiro"), sl.Pose((0.0, 0.0, 2.0), np.eye(3))).state
    given: dict[str, Any] = {"duration": 0.06, "cable_mass": "lumped", "nodes": 8, "events": [sl.Drop(60.0, 0.01)]}
    free = sl.simulate(state, **given)
    run = sl.simulate(state, damping=sl.Damping(loss_time=1e-2), **given)
    assert run.step == free.step
    fine = sl.simulate(state, damping=sl.Damping(loss_time=1e-2), step=run.step / 8, record=0.01, **given)
    moved = np.abs(fine.pose.position - free.pose.position).max()
    assert np.abs(run.pose.position - fine.pose.position).max() < 0.01 * moved
    assert run.energy.lost[-1] == pytest.approx(fine.energy.lost[-1], rel=5e-3)
    assert run.energy.lost[-1] > 0.1
    assert np.abs(run.energy.error).max() < 1e-2 * run.energy.lost[-1]


def test_losses_keep_cables_with_mass_at_rest() -> None:
    state = sl.inverse(sl.load_robot("article-suspended"), sl.Pose((1.0, 0.5, 1.5), np.eye(3))).state
    run = sl.simulate(state, duration=0.1, cable_mass="lumped", nodes=10, damping=sl.Damping(loss_time=0.1))
    assert np.abs(run.pose.position - run.pose.position[0]).max() < 1e-12
    assert np.abs(run.tensions - run.tensions[0]).max() < 1e-8
