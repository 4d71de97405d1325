"""The package for JavaScript: two files in an npm archive, in node and in Chromium, with the numbers of the library."""

import json
import subprocess
import tarfile
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from sagline.share.packing import EXPORTS, SCRIPT, page_script
from tests.chromium import NEEDED, launched
from tests.tiers import extended
from tools.javascript import description, pack

ROBOT = "cogiro"
RUN = """
import {{ load }} from "{module}";
const robot = await (await load()).robot({robot});
const poses = {poses}, found = poses.map((pose) => {{
  const plan = robot.inverse(pose);
  return {{ plan, rest: robot.forward(plan.length, pose) }};
}});
"""
# arguments of the functions, and the words of the message
WRONG = {
    "robot.inverse({ quaternion: [0, 0, 0, 1] })": "position is undefined; allowed: 3 numbers",
    "robot.inverse({ position: [0, 0], quaternion: [0, 0, 0, 1] })": "position is 0, 0; allowed: 3 numbers",
    "robot.inverse({ position: [0, 0, NaN], quaternion: [0, 0, 0, 1] })": "position is 0, 0, NaN; allowed",
    "robot.inverse({ position: [0, 0, 1e7], quaternion: [0, 0, 0, 1] })": "up to 1000000 m",
    "robot.inverse({ position: [0, 0, '1'], quaternion: [0, 0, 0, 1] })": "position is 0, 0, 1; allowed: 3 numbers",
    "robot.inverse({ position: [0, 0, 1], quaternion: [0, 0, 0, 0.9] })": "the length of the quaternion is 0.9",
    "robot.inverse({ position: [0, 0, 1], quaternion: [0, 0, 0] })": "quaternion is 0, 0, 0; allowed: 4 numbers",
    "robot.forward([1, 2], pose)": "length is 1, 2; allowed: 8 numbers, > 0 m",
    "robot.forward([1, 2, 3, 4, 5, 6, 7, 0], pose)": "allowed: 8 numbers, > 0 m",
    "robot.forward([1, 2, 3, 4, 5, 6, 7, Infinity], pose)": "allowed: 8 numbers, > 0 m",
    "robot.forward(null, pose)": "length is null; allowed: 8 numbers",
    "robot.courses({ position: [0, 0] }, tension)": "position is 0, 0; allowed: 3 numbers",
    "robot.courses({ position: [0, 0, 1], quaternion: [0, 0, 0, 2] }, tension)": "quaternion is 0, 0, 0, 2; allowed: 4",
    "robot.courses(pose, [1, 2])": "tension is 1, 2; allowed: 8 numbers, >= 0 N or NaN",
    "robot.courses(pose, tension.with(3, -1))": "allowed: 8 numbers, >= 0 N or NaN",
    "robot.courses(pose, tension.with(3, Infinity))": "allowed: 8 numbers, >= 0 N or NaN",
    "robot.courses(pose, null)": "tension is null; allowed: 8 numbers",
    "await sagline.robot({})": "sagline convert ROBOT --kind javascript",
    "await sagline.robot('5')": "sagline convert ROBOT --kind javascript",
    "await sagline.robot({ ...machine, module: 1 })": "the robot is for another kernels.wasm",
}


@pytest.fixture
def robot() -> sl.Robot:
    return sl.load_robot(ROBOT)


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """Folder of the unpacked package, with a robot."""
    with tarfile.open(pack(tmp_path)) as archive:
        archive.extractall(tmp_path, filter="data")
    result = CliRunner().invoke(app, ["convert", ROBOT, "--kind", "javascript", "--out", str(tmp_path / "robot.json")])
    assert result.exit_code == 0, result.output
    return tmp_path / "package"


def poses() -> sl.Pose:
    return sl.Pose.from_euler([[0, 0, 1.5], [1, -0.5, 2.0], [-2.0, 1.5, 2.5]], [0.0, 0.2, -0.1], 0.05, 0.0)


def as_json() -> str:
    pairs = zip(poses().position.tolist(), poses().quaternion.tolist(), strict=True)
    return json.dumps([{"position": position, "quaternion": quaternion} for position, quaternion in pairs])


def compare(found: list[dict[str, Any]], robot: sl.Robot) -> None:
    """Lengths to 1e-12 m, tensions to 1e-12 of their size, and the poses of these lengths."""
    plan = sl.inverse(robot, poses())
    assert all(one["plan"]["feasible"] and one["rest"]["solved"] for one in found)
    for name, expected in (("tension", plan.chord_tension), ("length", plan.unstrained_length)):
        np.testing.assert_allclose([one["plan"][name] for one in found], expected, rtol=1e-12)
    rests = [one["rest"]["position"] for one in found]
    np.testing.assert_allclose(rests, poses().position, rtol=0.0, atol=1e-11)


def in_node(text: str, folder: Path) -> Any:
    (folder / "run.mjs").write_text(text, encoding="utf-8")
    done = subprocess.run(["node", str(folder / "run.mjs")], capture_output=True, check=True)
    return json.loads(done.stdout)


def test_the_archive_has_two_files_and_their_description(tmp_path: Path) -> None:
    first, second = pack(tmp_path / "a"), pack(tmp_path / "b")
    assert first.read_bytes() == second.read_bytes()
    assert first.stat().st_size < 100_000
    with tarfile.open(first) as archive:
        names = archive.getnames()
    wanted = {f"package/{name}" for name in (*description()["files"], "package.json", "LICENSE")}
    assert set(names) == wanted
    assert description()["version"] == sl.__version__


def test_a_page_contains_the_module_without_its_exports() -> None:
    text = SCRIPT.read_text(encoding="utf-8")
    assert text.count(EXPORTS) == 1
    assert text.startswith(page_script())
    code = page_script()[page_script().index("*/") :]
    assert not any(word in code for word in ("export ", "import ", "import.meta", "fetch("))


@extended
def test_node_has_the_numbers_of_the_library(package: Path, robot: sl.Robot) -> None:
    data = (package.parent / "robot.json").read_text(encoding="utf-8")
    text = RUN.format(module="./package/sagline.mjs", robot=json.dumps(data), poses=as_json())
    compare(in_node(f"{text}\nconsole.log(JSON.stringify(found));", package.parent), robot)


@extended
def test_wrong_arguments_are_refused_in_one_line(package: Path) -> None:
    data = (package.parent / "robot.json").read_text(encoding="utf-8")
    calls = ",".join(f"async () => {call}" for call in WRONG)
    text = f"""
import {{ load }} from "./package/sagline.mjs";
const machine = {data}, sagline = await load(), robot = await sagline.robot(machine);
const pose = {{ position: [0, 0, 1.5], quaternion: [0, 0, 0, 1] }}, tension = [...Array(8)].map(() => NaN), found = [];
const told = (error) => `${{error.name}}: ${{error.message}}`;
for (const call of [{calls}]) found.push(await call().then(() => "accepted", told));
console.log(JSON.stringify(found));
"""
    found = in_node(text, package.parent)
    for call, message in zip(WRONG, found, strict=True):
        assert message.startswith(("RangeError: ", "TypeError: ")), f"{call}: {message}"
        assert WRONG[call] in message, f"{call}: {message}"
        assert "\n" not in message


@extended
def test_without_an_equilibrium_there_are_no_numbers(package: Path, robot: sl.Robot) -> None:
    data = (package.parent / "robot.json").read_text(encoding="utf-8")
    at, short = sl.Pose((0.0, 0.0, 1.5), np.eye(3)), np.full(8, 1e-3)  # m, of cables that cannot reach
    strained = sl.inverse(robot, at).unstrained_length * 0.9
    given = json.dumps([short.tolist(), strained.tolist()])
    text = f"""
import {{ load }} from "./package/sagline.mjs";
const robot = await (await load()).robot({data}), pose = {{ position: [0, 0, 1.5], quaternion: [0, 0, 0, 1] }};
console.log(JSON.stringify({given}.map((length) => robot.forward(length, pose))));
"""
    lost, found = in_node(text, package.parent)
    assert sl.forward(robot, short, at).status == lost["status"] == sl.ForwardStatus.NOT_CONVERGED
    assert not lost["solved"]
    assert [lost[name] for name in ("position", "quaternion", "tension")] == [None, None, None]
    rest = sl.forward(robot, strained, at)
    assert found["status"] == rest.status
    np.testing.assert_allclose(found["position"], rest.pose.position, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(found["tension"], rest.state.chord_tension, rtol=1e-9)


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *words: object) -> None:
        """Write nothing."""


@pytest.fixture
def address(package: Path) -> Iterator[str]:
    """Address of a server of the folder with the package."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(package.parent)))
    Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()


@NEEDED
@extended
def test_a_browser_has_the_numbers_of_the_library(package: Path, address: str, robot: sl.Robot) -> None:
    given = 'await (await fetch("robot.json")).text()'
    text = RUN.format(module="./package/sagline.mjs", robot=given, poses=as_json())
    page = f'<!doctype html><link rel="icon" href="data:,"><script type="module">{text} window.found = found;</script>'
    (package.parent / "index.html").write_text(page, encoding="utf-8")
    for browser in launched("--disable-gpu --disable-component-update"):
        opened = browser.new_page()
        opened.goto(f"{address}/index.html")
        opened.wait_for_function("window.found !== undefined")
        compare(opened.evaluate("window.found"), robot)
