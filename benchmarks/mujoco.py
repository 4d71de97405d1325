"""Steps of MuJoCo with exact cables, without cables, and with chains of links: `python -m benchmarks.mujoco`."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any, Final

import mujoco
import numpy as np

import sagline as sl
from benchmarks.measure import Row, print_table

ROBOT: Final = sl.load_robot("cogiro")
PLACE: Final = 0.0, 0.0, 2.0
STEP: Final = 1e-3  # s
LINKS: Final = 20
ROUNDS, MOST = 1000, 200  # repetitions of all models in turn; steps in one repetition
INTEGRATORS: Final = {"Euler": mujoco.mjtIntegrator.mjINT_EULER, "RK4": mujoco.mjtIntegrator.mjINT_RK4}


def with_cables(integrator: Any) -> Any:
    """Model with exact cables, winches and sensor."""
    spec = sl.mujoco.model_of(ROBOT, PLACE)
    spec.option.timestep, spec.option.integrator = STEP, integrator
    return spec.compile()


def without_cables(integrator: Any) -> Any:
    """Specification of the same platform and sites without cables."""
    spec = sl.mujoco.model_of(ROBOT, PLACE)
    spec.body("platform").plugin.active = False
    for each in (*spec.actuators, *spec.sensors, *spec.plugins):
        spec.delete(each)
    spec.option.timestep, spec.option.integrator = STEP, integrator
    return spec


def with_chains(integrator: Any) -> Any:
    """The same platform on chains of rigid links with the mass of the cables."""
    spec = without_cables(integrator)
    ends = ROBOT.platform_anchors + PLACE
    for i, (start, end) in enumerate(zip(ROBOT.frame_anchors, ends, strict=True)):
        link, along = spec.worldbody, (end - start) / LINKS
        for k in range(LINKS):
            link = link.add_body(name=f"link_{i}_{k}", pos=start if k == 0 else along)
            link.add_joint(type=mujoco.mjtJoint.mjJNT_BALL)
            mass = ROBOT.cables.linear_density[i] * np.linalg.norm(along)
            link.add_geom(
                type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=(0.0, 0.0, 0.0, *along), size=(0.004, 0.0, 0.0), mass=mass,
                contype=0, conaffinity=0,
            )  # fmt: skip
        tip = link.add_site(name=f"tip_{i}", pos=along)
        spec.add_equality(
            type=mujoco.mjtEq.mjEQ_CONNECT, objtype=mujoco.mjtObj.mjOBJ_SITE, name1=tip.name, name2=f"platform_{i}"
        )
    return spec.compile()


def times(integrator: str) -> dict[str, float]:
    """Shortest mean time of a step [s] of each model; the models run in turn."""
    kind = INTEGRATORS[integrator]
    models = {"cables": with_cables(kind), "bare": without_cables(kind).compile(), "chains": with_chains(kind)}
    data = {name: mujoco.MjData(model) for name, model in models.items()}
    least = dict.fromkeys(models, np.inf)
    for k in range(ROUNDS):
        for name, model in models.items():
            if name == "chains" and k % 100:
                continue
            steps = 2 if name == "chains" else MOST // 4 if integrator == "RK4" else MOST
            begin = time.perf_counter()
            mujoco.mj_step(model, data[name], nstep=steps)
            least[name] = min(least[name], (time.perf_counter() - begin) / steps)
    moved = np.abs(data["cables"].body("platform").xpos - PLACE).max()
    assert moved < 1e-9, moved
    return least


def rows() -> Iterator[Row]:
    """Steps of 1 ms."""
    for integrator in INTEGRATORS:
        found = times(integrator)
        cables, bare, chains = found["cables"], found["bare"], found["chains"]
        yield Row(
            f"step of 1 ms with 8 exact cables, {integrator}: relative to a step without cables; speed",
            "<= 1.5 x; >= 100 x real time",
            f"{1e6 * cables:.2f} µs, {cables / bare:.2f} x ({1e6 * bare:.2f} µs); {STEP / cables:.0f} x real time",
        )
        yield Row(
            f"step with chains of {LINKS} links, {integrator}: relative to exact cables; speed",
            ">= 100 x",
            f"{1e3 * chains:.2f} ms, {chains / cables:.0f} x; {STEP / chains:.2g} x real time",
        )


if __name__ == "__main__":
    print_table("MuJoCo", [rows])
