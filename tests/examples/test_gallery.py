"""Every example of the gallery runs and gives the number in its text."""

import re
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import sagline as sl
from tests.tiers import extended

pytestmark = extended
EXAMPLES = Path(__file__).parents[2] / "examples"
Run = Callable[[str], dict[str, Any]]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    monkeypatch.chdir(tmp_path)
    return lambda name: runpy.run_path(str(EXAMPLES / f"{name}.py"))


def test_one_cable(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    names = run("one_cable")
    # w D^2 / (8 tau) to first order, with the weight along the chord: 0.067 * 9.81 * 160 / (8 * 200)
    assert names["exact"].sag[-1] == pytest.approx(0.0657, rel=0.01)
    assert names["worst"]["Straight"] == pytest.approx(76.3, abs=0.1)
    assert re.match(r" +20 N: 12\.7254 m .* 659 mm ", capsys.readouterr().out)
    assert Path("one_cable.png").stat().st_size > 10_000


def test_which_model(run: Run) -> None:
    largest = run("which_model")["largest"]
    assert largest["article-suspended", "Empirical"] == pytest.approx(1.66, abs=0.01)  # mm
    assert largest["article-mixed", "Catenary"] < 1e-6
    assert Path("which_model.png").is_file()


def test_feasible_region(run: Run) -> None:
    names = run("feasible_region")
    assert names["share"] == pytest.approx(0.754, abs=0.002)
    assert names["plan"].shortfall[0] == pytest.approx(357.0, abs=1.0)
    assert Path("feasible_region.png").is_file()


def test_where_it_works(run: Run) -> None:
    names = run("where_it_works")
    box, volumes = names["space"].box, list(names["volumes"].values())
    places = np.random.default_rng(3).uniform(box.low, box.high, (4000, 3))
    held = sl.inverse(names["robot"], sl.Pose.from_euler(places, 0.0, 0.0, 0.0)).feasible.mean()
    assert volumes[0] == pytest.approx(held * np.prod(box.high - box.low), rel=0.03)  # of 4,000 points
    assert volumes == sorted(volumes, reverse=True)
    for name in ("where_it_works_hull.png", "where_it_works_slice.png", "hull.glb"):
        assert Path(name).stat().st_size > 10_000


def test_how_fast(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("how_fast")["fastest"] == 1.5
    assert re.search(r"\b1\.0 s: .* 0\.09 s .*\b226 N", capsys.readouterr().out)


def test_few_cables(run: Run) -> None:
    left = run("few_cables")["left"]
    assert left["unshaped"] == pytest.approx(0.289, abs=0.002)  # m
    assert left["shaped"] == pytest.approx(0.012, abs=0.001)


def test_train_policy(run: Run) -> None:
    distance = run("train_policy")["distance"]
    np.testing.assert_allclose(np.ptp(distance["without a policy"]), 0.0, atol=1e-6)  # the robots are at rest
    first, last = distance["with the policy"][[0, -1]]
    assert last < 0.3 * first
    assert Path("train_policy.png").stat().st_size > 10_000


def test_control_loop(run: Run) -> None:
    names = run("control_loop")
    assert names["difference"] < 1e-12
    assert np.median(names["times"]) < 1e-3  # s; the loop runs at 1 kHz


def test_feedforward(run: Run) -> None:
    distance = run("feedforward")["distance"]
    planned, static = distance["planned"], distance["static"]
    assert max(planned) < 6e-4  # m
    assert max(static) > 5e-3
    assert max(static[-2000:]) > 5.0 * max(planned[-2000:])  # the residual after the end of the motion


def test_pose_loop(run: Run) -> None:
    names = run("pose_loop")
    assert 1e3 * names["without"][-1] == pytest.approx(14.58, abs=0.01)
    assert max(names["closed"][-100:]) < 2e-4


def test_encoders(run: Run) -> None:
    names = run("encoders")
    assert names["found"].solved.all()
    assert 1e3 * names["error"].mean() == pytest.approx(1.1, abs=0.1)


def test_to_mujoco(run: Run) -> None:
    text = run("to_mujoco")["text"]
    assert Path("ipanema-2.xml").read_text() == text
    model = mujoco.MjModel.from_xml_path("ipanema-2.xml")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.qacc, 0.0, atol=1e-8)  # m/s^2: the body rests at its start
