"""Artificial simulations for files, and their comparison."""

from operator import attrgetter

import numpy as np

import sagline as sl
from sagline import Occurrence, dump_robot
from sagline.core.arrays import Array
from sagline.files.simulation_file import LARGEST, NODES, SAMPLES, TIME

ROBOT = sl.load_robot("article-suspended")
SAMPLE_COUNT, NODE_COUNT = 7, 5
HAPPENED = (
    Occurrence(0.1, "break", 3, 123.4, 456.7),
    Occurrence(1.0 / 3.0, "pick up", None, 200.0, float("nan")),
    Occurrence(0.5, "slack", 0, 0.0, 1e3),
)


def a_simulation(
    events: tuple[Occurrence, ...] = HAPPENED, nodes: bool = True, robot: sl.Robot = ROBOT
) -> sl.Simulation:
    rng = np.random.default_rng(12)
    count, cables = SAMPLE_COUNT, robot.cable_count
    pose = sl.Pose.from_euler(rng.normal(size=(count, 3)), *rng.normal(size=(3, count)))
    time, length = np.arange(count) / 3.0, rng.random((count, cables))
    points = rng.normal(size=(count, cables, NODE_COUNT, 3))
    for event in events:
        if event.kind == "break":
            length[time > event.time, event.cable] = points[time > event.time, event.cable] = np.nan
    return sl.Simulation(
        robot=robot,
        time=time,
        pose=pose,
        twist=rng.normal(size=(count, 6)),
        tensions=rng.random((count, cables)),
        length=length,
        energy=balance(*rng.random((5, count))),
        events=events,
        cable_mass="lumped" if nodes else "none",
        step=0.1 / 3.0,
        nodes=points if nodes else None,
        integrator="splitting",
        winches=sl.SecondOrder(10.0, 0.7) if nodes else "robot",
        winding="constant" if nodes else "remembered",
        damping=sl.Damping(1e-3, 0.2),
        largest_tension=1.0 + rng.random(cables) if nodes else None,
    )


def balance(kinetic: Array, potential: Array, supplied: Array, lost: Array, removed: Array) -> sl.EnergyBalance:
    """Energies [J] whose error is the sum of the others."""
    total = kinetic + potential - supplied + lost + removed
    return sl.EnergyBalance(kinetic, potential, supplied, lost, removed, total - total[0])


def assert_same(simulation: sl.Simulation, other: sl.Simulation) -> None:
    assert (simulation.largest_tension is None) == (other.largest_tension is None)
    known = (LARGEST,) if simulation.largest_tension is not None else ()
    for quantity in (TIME, *SAMPLES, *known, *(() if simulation.nodes is None else (NODES,))):
        mine, theirs = (np.asarray(attrgetter(quantity.place)(s)) for s in (simulation, other))
        assert (mine.dtype, mine.shape) == (theirs.dtype, theirs.shape), quantity.place
        assert mine.tobytes() == theirs.tobytes(), quantity.place
        assert not theirs.flags.writeable, quantity.place
    assert (simulation.nodes is None) == (other.nodes is None)
    assert repr(simulation.events) == repr(other.events)  # NaN equals NaN; numbers of Python stay numbers of Python
    for name in ("cable_mass", "step", "integrator", "winches", "winding", "damping"):
        mine, theirs = (getattr(one, name) for one in (simulation, other))
        assert (mine, type(mine)) == (theirs, type(theirs)), name
    assert dump_robot(simulation.robot) == dump_robot(other.robot)
