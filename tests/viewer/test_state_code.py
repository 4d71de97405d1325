"""Copied code, executed: the numbers on the screen, to the last bit."""

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.core.surface import public_names
from sagline.viewer.feature import View
from sagline.viewer.features import FEATURES
from sagline.viewer.features.state import code_of
from sagline.viewer.page import Page, Source
from sagline.viewer.panel import mass_range
from sagline.viewer.playback import PlayedPlan, PlayedSimulation
from sagline.viewer.snapshot import METHODS, MODELS, Settings, Snapshot, depends_on_history, snapshot_at
from sagline.viewer.tension_scale import TensionScale
from tests.tiers import extended, wide
from tests.viewer.client import PATIENCE, Client, await_that
from tests.viewer.shown import Shown, handle, shown, with_mass

ROBOTS = ("falcon-7", "cogiro", "fast", "ipanema-2-pulleys", "article-suspended")


def executed(code: str) -> dict[str, Any]:
    """The names that lines of Python leave behind."""
    names: dict[str, Any] = {}
    exec(compile(code, "copied", "exec"), names)
    return names


def same(code: str, snapshot: Snapshot) -> None:
    """Executed, the lines give what is shown."""
    if snapshot.plan is None:
        with pytest.raises(sl.CableGeometryError):
            executed(code)
        return
    names = executed(code)
    np.testing.assert_array_equal(names["tension"], snapshot.tension)
    np.testing.assert_array_equal(names["plan"].unstrained_length, snapshot.plan.unstrained_length)
    np.testing.assert_array_equal(names["pose"].quaternion, snapshot.pose.quaternion)
    np.testing.assert_array_equal(names["robot"].inertia, snapshot.robot.inertia)
    assert (snapshot.rest is None) == ("rest" not in names)
    if snapshot.rest is not None:
        np.testing.assert_array_equal(names["rest"].position, snapshot.rest.position)


def a_pose(robot: sl.Robot, random: np.random.Generator) -> sl.Pose:
    """In the middle of where a robot is meant to be, or somewhat beyond, turned if it turns."""
    box = robot.test_box
    low, high = (
        (robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)) if box is None else (box.low, box.high)
    )
    turns = random.uniform(-0.3, 0.3, 3) if robot.motion_pattern == "3R3T" else np.zeros(3)
    return sl.Pose.from_euler(low + random.uniform(-0.1, 1.1, 3) * (high - low), *turns)


def settings(robot: sl.Robot, random: np.random.Generator) -> Settings:
    """Settings of all controls of the page, and tension methods with arguments."""
    lightest, heaviest, step = mass_range(robot.mass)
    steps = int(random.integers(round((heaviest - lightest) / step)))
    method = list(METHODS.values())[int(random.integers(len(METHODS)))]
    own = (
        sl.QuadraticProgram(weights=random.uniform(0.5, 2.0, robot.cable_count), target=random.uniform(0.0, 9e2)),
        sl.PNorm(p=float(random.uniform(2.0, 9.0)), lowest_point_margin=0.5),
        sl.Closest("horizontal"),
    )
    return Settings(
        mass=lightest + steps * step if random.random() < 0.7 else robot.mass,
        density=float(random.choice([1.0, 0.1 * random.integers(1, 100)])),
        stiffness=float(random.choice([1.0, 0.1 * random.integers(1, 100)])),
        model=list(MODELS.values())[int(random.integers(len(MODELS)))],
        tension=method if random.random() < 0.7 else own[int(random.integers(len(own)))],
    )


def a_case(seed: int) -> None:
    random = np.random.default_rng([20261122, seed])
    name = ROBOTS[seed % len(ROBOTS)]
    own = sl.load_robot(name)
    loaded = random.random() < 0.3
    robot = with_mass(own, own.mass + random.uniform(0.1, 2.0) * own.mass) if loaded else own
    wrench = random.uniform(-0.2, 0.2, 6) * robot.mass * 9.81 if random.random() < 0.4 else None
    source, previous = Source.of_robot(name, robot.mass if loaded else None), None
    set_to = settings(robot, random)
    changed = set_to.applied(robot)
    for _ in range(3 if depends_on_history(set_to.tension) else 1):
        try:
            snapshot = snapshot_at(changed, a_pose(robot, random), set_to, previous, wrench=wrench)
        except sl.InvalidValueError:  # this robot cannot be shared so: the page says it, and shows nothing
            return
        previous = snapshot.plan if snapshot.feasible else previous
        same(code_of(View(snapshot, set_to, TensionScale.of(robot), False, wrench), robot, source), snapshot)


@pytest.mark.parametrize(
    ("start", "end"), [(0, 10), pytest.param(10, 40, marks=extended), pytest.param(40, 3000, marks=pytest.mark.soak)]
)
def test_code_agrees_with_the_page_for_any_setting(start: int, end: int) -> None:
    for seed in range(start, end):
        a_case(seed)


def test_only_arguments_other_than_defaults_are_written() -> None:
    robot = sl.load_robot("cogiro")
    tension = sl.QuadraticProgram(target=300.0, variable="frame_end")
    set_to = Settings(robot.mass, model=sl.Empirical(k_h=5.0), tension=tension)
    snapshot = snapshot_at(robot, sl.Pose([0.0, 0.0, 2.0], np.eye(3)), set_to, None)
    code = code_of(View(snapshot, set_to, TensionScale.of(robot), False), robot, Source())
    assert "model=sl.Empirical(k_h=5.0)," in code
    method = re.search(r"tension=sl\.QuadraticProgram\((.*?)\),", code, re.DOTALL)
    assert method is not None
    assert {each.strip() for each in method[1].split(",")} == {"variable='frame_end'", "target=300.0"}
    assert "wrench" not in code
    assert {type(method).__name__ for method in METHODS.values()} <= set(
        public_names("sagline")
    )  # all can be written so
    same(code, snapshot)


def path_of(robot: sl.Robot) -> sl.Path:
    ends = sl.Pose(np.array([[0.0, 0.0, 1.5], [2.0, 1.0, 1.5]]), np.stack([np.eye(3)] * 2))
    return sl.quintic_path(ends, durations=[1.0], rate=20)


def test_a_sample_of_a_run_in_a_file(tmp_path: Path) -> None:
    robot, file = sl.load_robot("article-suspended"), tmp_path / "a 'run'.nc"
    sl.inverse(robot, path_of(robot), model=sl.Empirical()).save(file)
    run = PlayedPlan(sl.load_plan(file))
    for time in (0.0, 0.52, 9.0):
        view = View(run.at(time), Settings(robot.mass), TensionScale.of(robot), False, None, run)
        names = executed(code_of(view, robot, Source.of_file("plan", file), time))
        np.testing.assert_array_equal(names["tension"], run.at(time).tension)
        np.testing.assert_array_equal(names["pose"].position, run.at(time).pose.position)
        rest = run.at(time).rest
        assert rest is not None
        np.testing.assert_array_equal(names["rest"].position, rest.position)


@extended
def test_the_robot_of_a_run_is_that_of_the_file(tmp_path: Path) -> None:
    robot, file = sl.load_robot("article-suspended"), tmp_path / "run.nc"
    sl.inverse(robot.replace(mass=77.0), path_of(robot)).save(file)
    set_to = Settings(77.0)
    snapshot = snapshot_at(robot.replace(mass=77.0), sl.Pose([0.1, 0.2, 1.6], np.eye(3)), set_to, None)
    view = View(snapshot, set_to, TensionScale.of(robot), False)
    same(code_of(view, robot.replace(mass=77.0), Source.of_file("plan", file)), snapshot)


def test_a_time_of_a_simulation_in_a_file(tmp_path: Path) -> None:
    robot, file = sl.load_robot("article-suspended"), tmp_path / "cut.nc"
    state = sl.inverse(robot, sl.Pose([0.0, 0.0, 1.5], np.eye(3))).state
    sl.simulate(state, duration=0.2, events=(sl.Break(cable=0, time=0.05),)).save(file)
    playback = PlayedSimulation(sl.load_simulation(file))
    moment = playback.at(0.13)
    view = View(moment, Settings(robot.mass), TensionScale.of(robot), False, None, playback)
    names = executed(code_of(view, robot, Source.of_file("simulation", file), 0.13))
    assert moment.index > 0
    np.testing.assert_array_equal(names["tension"][1:], moment.tension[1:])
    np.testing.assert_array_equal(names["pose"].position, moment.pose.position)


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, sl.load_robot("cogiro"), source=Source.of_robot("cogiro")))


def asked(page: Shown, topic: str, text: Any, name: str = "me-1") -> dict[str, Any]:
    """Answer to a page."""
    with Client(page.url) as client:
        field = handle(page, "sagline")
        client.set(field, json.dumps({"topic": topic, "value": [name, text], "count": 0}))
        for message in client.heard(PATIENCE):
            content = str((message.get("props") or message.get("updates") or {}).get("content", ""))
            start = f"sagline:{topic}-reply:"
            if content.startswith(start) and json.loads(content[len(start) :])["to"] == name:
                return dict(json.loads(content[len(start) :]))
    raise AssertionError("no answer")


def test_every_control_of_the_robot_is_in_the_code(page: Shown) -> None:
    def tension() -> Array:
        assert page.viewer.view is not None
        assert isinstance(page.viewer.view.snapshot, Snapshot)
        return page.viewer.view.snapshot.tension

    changes = {"Platform + load [kg]": 123.0, "Cable density ×": 2.3, "Cable stiffness ×": 0.4,
               "Cable model": "parabolic", "Tensions": "Centroid"}  # fmt: skip
    for k, (label, value) in enumerate(changes.items()):
        before = tension()
        with Client(page.url) as client:
            client.set(handle(page, label), value)
            await_that(lambda before=before: not np.array_equal(tension(), before))  # type: ignore[misc]
        names = executed(asked(page, "copy", "code", f"copy-{k}")["text"])
        np.testing.assert_array_equal(names["tension"], tension())


def test_rounding_errors_of_a_browser_are_not_copied(page: Shown) -> None:
    with Client(page.url) as client:
        client.drag([0.125, 1e-17, 2.0], (1.0, 0.0, -3e-33, -2.7e-48))
        await_that(lambda: page.position[0] == 0.125)
    code = asked(page, "copy", "code", "level")["text"]
    assert "pose = sl.Pose.from_euler([0.125, 0.0, 2.0], 0, 0, 0)" in code
    page.viewer.later(page.viewer.go_home)
    await_that(lambda: page.position[0] == 0.0)
    code = asked(page, "copy", "code", "home")["text"]
    assert "sl.Pose.from_euler([0.0, 0.0, 2.6], 0, 0, 0)" in code


@extended
def test_a_typed_pose_is_shown_and_an_invalid_one_refused_in_a_line(page: Shown) -> None:
    assert asked(page, "pose", " 0.5, -0.25,1.75, 10, 0, 0 ", "a") == {"to": "a"}
    wanted = sl.Pose.from_euler([0.5, -0.25, 1.75], np.radians(10.0), 0.0, 0.0)

    def there() -> bool:
        assert page.viewer.view is not None
        pose = page.viewer.view.snapshot.pose
        return np.array_equal(pose.position, wanted.position) and np.array_equal(pose.quaternion, wanted.quaternion)

    await_that(there)
    for k, text in enumerate(("", "1,2", "1,2,x", "nan,0,1", "1e9,0,0", "300,0,0", "1,2,3,4,5,6,7", "x" * 9000)):
        told = asked(page, "pose", text, f"b{k}")
        assert len(told["refused"]) < 300
        assert "\n" not in told["refused"]
        assert there()


@pytest.mark.parametrize("value", wide([["a", 3], None, 3, [], ["a"], [3, "code"], ["x" * 50, "code"], {"to": "x"}]))
def test_invalid_requests_are_ignored(page: Shown, value: Any) -> None:
    with Client(page.url) as client:
        for topic in ("pose", "copy"):
            client.set(handle(page, "sagline"), json.dumps({"topic": topic, "value": value, "count": 0}))
    assert "'other'" in asked(page, "copy", "other", "z")["refused"]
    assert page.thread.is_alive()


@extended
def test_states_without_a_file_are_refused_in_a_line() -> None:
    robot = sl.load_robot("article-suspended")
    run = PlayedPlan(sl.inverse(robot, path_of(robot)))
    with contextmanager(shown)(lambda server: Page(server, FEATURES, robot, run)) as page:
        assert asked(page, "copy", "code", "c")["refused"].startswith("the run ")
