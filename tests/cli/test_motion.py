"""`sagline vibrate` and `sagline simulate`: numbers of the library, files, and messages for empty results."""

import json
import re
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline import to_shape
from sagline.cli.main import app
from sagline.cli.values import quantity, ratio
from tests.dynamics.machines import prototype
from tests.tiers import extended

WAY = "durations: 1\nrate: 100\nwaypoints: [{position: [0, 0, 1.5]}, {position: [1, 0, 1.5]}]\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> FilePath:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    (tmp_path / "way.yaml").write_text(WAY)
    return tmp_path


def sagline(*words: str) -> Any:
    return CliRunner().invoke(app, list(words))


def test_the_modes_agree_with_the_library(folder: FilePath) -> None:
    result = sagline(
        "vibrate", "article-suspended", "--pose", "3,2,1.5", "--up-to", "2", "--loss-time", "1e-3", "--json"
    )
    assert result.exit_code == 0, result.stderr
    found = json.loads(result.stdout)
    state = sl.inverse(sl.load_robot("article-suspended"), sl.Pose([3, 2, 1.5], np.eye(3))).state
    modes = sl.vibration(state, up_to=2.0, damping=sl.Damping(loss_time=1e-3, modal_damping=0.01))
    swinging = [mode for mode in found["modes"] if mode["kind"] == "with cable mass"]
    # the lowest six, as by finite elements
    told = [mode["frequency_hz"] for mode in swinging]
    np.testing.assert_allclose(told[:6], [1.32058, 1.32629, 1.36270, 1.41008, 1.75574, 1.82122], atol=1e-5)
    np.testing.assert_allclose([mode["platform_share"] for mode in swinging], modes.platform_share, rtol=1e-9)
    np.testing.assert_allclose([mode["damping_ratio"] for mode in swinging], modes.loss, rtol=1e-9)
    light = [mode["frequency_hz"] for mode in found["modes"] if mode["kind"] == "massless"]
    np.testing.assert_allclose(light, sl.modes(state).frequency, rtol=1e-12)
    assert found["complete"] is True
    names = sorted(file.name for file in (folder / "output").iterdir())
    assert names == [f"article-suspended-{each}" for each in ("modes.csv", "response.png", "response.svg")]


def test_frequencies_have_descriptions_and_hidden_modes_are_counted(folder: FilePath) -> None:
    result = sagline("vibrate", "cogiro", "--pose", "0,0,2", "--up-to", "12", "--no-figures")
    assert result.exit_code == 0, result.stderr
    state = sl.inverse(sl.load_robot("cogiro"), sl.Pose([0, 0, 2], np.eye(3))).state
    modes = sl.vibration(state, up_to=12.0)
    text = " ".join(result.stdout.split())
    assert re.search(rf"\b{modes.count} modes .* 12 Hz, ", text)
    assert f" {sl.modes(state).frequency[-1]:.3f} Hz" in text
    rows = [line.split() for line in result.stdout.splitlines() if line.strip()[:1].isdigit() and "mode" not in line]
    assert [float(row[1]) for row in rows[:3]] == modes.frequency[:3].round(3).tolist()
    assert f"Not shown: {modes.count - len(rows)} " in text
    beside = [row[-1] for row in rows if len(row) == 7]
    assert beside == [f"{each:.3f}" for each in sl.modes(state).frequency[:-1]]
    table = (folder / "output" / "cogiro-modes.csv").read_text().splitlines()
    assert len(table) == 1 + modes.count + 6


def test_without_a_mode_in_the_range_the_lowest_massless_one_is_printed(folder: FilePath) -> None:
    result = sagline("vibrate", "article-suspended", "--pose", "0,0,1.5", "--up-to", "1", "--no-figures")
    assert result.exit_code == 0, result.stderr
    text = " ".join(result.stdout.split())
    assert re.findall(r"[\d.]+ Hz", text)[:2] == ["1 Hz", "1.787 Hz"]
    assert "--up-to" in text
    assert "mode  " not in result.stdout


@extended
def test_a_film_of_ten_seconds(folder: FilePath) -> None:
    from PIL import Image

    result = sagline("vibrate", "article-suspended", "--up-to", "2.2", "--no-figures", "--film", "1")
    assert result.exit_code == 0, result.stderr
    with Image.open(folder / "output" / "article-suspended-mode-1.gif") as film:
        assert film.n_frames * film.info["duration"] == 10_000  # type: ignore[attr-defined]
        pictures = []
        for k in (0, 6, 25):
            film.seek(k)
            pictures.append(np.asarray(film.convert("L"), dtype=float))
    assert np.abs(pictures[0] - pictures[1]).max() > 50.0  # a quarter of a period later
    np.testing.assert_array_equal(pictures[0], pictures[2])


def test_a_break_agrees_with_the_library_and_its_file_can_be_read(folder: FilePath) -> None:
    words = ["--break", "3@0.2s", "--after", "1", "--loss-time", "1e-3", "--tension", "minimum-norm"]
    result = sagline("simulate", "cogiro", *words, "--out", "sim.nc")
    assert result.exit_code == 0, result.stderr
    robot = sl.load_robot("cogiro")
    assert robot.test_box is not None
    middle = sl.Pose(0.5 * (robot.test_box.low + robot.test_box.high), np.eye(3))
    state = sl.inverse(robot, middle, tension=sl.MinimumNorm()).state
    own = sl.simulate(state, duration=1.0, events=sl.Break(cable=3, time=0.2), damping=sl.Damping(loss_time=1e-3))
    read = sl.load_simulation(folder / "sim.nc")
    np.testing.assert_array_equal(read.tensions, own.tensions)
    assert np.isnan(read.length[-1, 3])
    text = " ".join(result.stdout.split())
    (event,) = own.events
    assert own.largest_tension is not None
    assert own.largest_tension.max() == event.tension_after > np.nanmax(own.tensions)  # also between samples
    np.testing.assert_array_equal(read.largest_tension, own.largest_tension)
    cable = int(own.largest_tension.argmax())
    assert f" {event.tension_after:,.1f} N, cable {cable} " in text
    assert "above tension_max" not in text
    before, after = f"{event.tension_before:,.1f} N", f"{event.tension_after:,.1f} N"
    assert re.search(rf"\b0\.200 s: .*\bcable 3, {before}\b.*\b{after}", text)
    assert (folder / "sim-energy.png").exists()


def test_pieces_of_a_broken_cable_and_limits_of_winches(folder: FilePath) -> None:
    weak = prototype(torque_limit=0.12)
    (folder / "weak.yaml").write_text(sl.dump_robot(weak))
    words = ["--pose", "0,0,1.0", "--winches", "robot", "--cable-mass", "lumped", "--break", "3@0.02s@0.5", "--after"]
    result = sagline("simulate", "weak.yaml", *words, "0.05", "--no-figures", "--out", "sim.nc")
    assert result.exit_code == 0, result.stderr
    first, cut = (next(each for each in result.stdout.splitlines() if kind in each) for kind in ("saturate", "break"))
    assert first.split()[3] == "(torque)"
    assert cut.split()[0] == "0.020"
    nodes = sl.load_simulation(folder / "sim.nc").nodes
    assert nodes is not None
    assert np.isnan(nodes[-1, 3, :, 0]).nonzero()[0].tolist() == [10]


@pytest.mark.parametrize("place", ["1.2", "-1", "frame"])
def test_positions_of_breaks_that_are_refused(folder: FilePath, place: str) -> None:
    result = sagline("simulate", "cogiro", "--cable-mass", "lumped", "--break", f"3@0.1s@{place}")
    assert result.exit_code == 2
    assert place.lstrip("-") in result.stderr


def test_cables_above_their_limit_are_named(folder: FilePath) -> None:
    robot = sl.load_robot("cogiro")
    (folder / "weak.yaml").write_text(sl.dump_robot(robot.replace(tension_max=800.0)))
    words = ["--break", "3@0.1s", "--after", "0.6", "--no-figures", "--out", "sim.nc"]
    result = sagline("simulate", "weak.yaml", *words)
    assert result.exit_code == 0, result.stderr
    largest = sl.load_simulation(folder / "sim.nc").largest_tension
    assert largest is not None
    above = np.flatnonzero(largest > 800.0)
    assert 0 < above.size < 8
    assert f" cables {', '.join(map(str, above))} " in " ".join(result.stdout.split())


def test_a_shaped_path_leaves_less_vibration(folder: FilePath) -> None:
    robot, way = sl.load_robot("article-suspended"), sl.load_path(folder / "way.yaml")
    result = sagline("simulate", "article-suspended", "way.yaml", "--shaper", "zvd", "--json", "--no-figures")
    assert result.exit_code == 0, result.stderr
    found = json.loads(result.stdout)
    frequency = to_shape(sl.modes(sl.inverse(robot, way.pose[len(way) - 1]).state), way)
    plan = sl.inverse(robot, sl.shaped(way, sl.ZVD(frequency)))
    assert plan.path is not None
    assert found["duration_s"] == pytest.approx(plan.path.time[-1] + 3.0, abs=0.02)
    assert found["residual_m"] < 1e-4
    assert found["energy_error_j"] < 1e-3
    assert " and ".join(f"{each:.3f}" for each in frequency) + " Hz (massless)" in result.stderr


@extended
def test_a_map_of_the_test_box(folder: FilePath) -> None:
    result = sagline("vibrate", "article-suspended", "--map", "3x2x1", "--up-to", "3", "--out", "maps", "--json")
    assert result.exit_code == 0, result.stderr
    found = json.loads(result.stdout)
    robot = sl.load_robot("article-suspended")
    assert robot.test_box is not None
    assert found["position_m"][0][:2] == robot.test_box.low[:2].tolist()
    assert found["position_m"][0][2] == pytest.approx(0.5 * (robot.test_box.low[2] + robot.test_box.high[2]))
    state = sl.inverse(robot, sl.Pose(found["position_m"][3], np.eye(3))).state
    lowest = sl.vibration(state, up_to=3.0).frequency[0]
    assert found["frequency_with_cable_mass_hz"][3] == pytest.approx(lowest, rel=1e-6)
    assert found["frequency_massless_hz"][3] == pytest.approx(sl.modes(state).frequency[0], rel=1e-9)
    names = {file.name for file in (folder / "maps").iterdir()}
    kinds = (".nc", "-frequency.png", "-frequency.svg", "-peak.png", "-peak.svg")
    assert names == {f"article-suspended-vibration-map{kind}" for kind in kinds}


def test_losses_may_be_given_in_percent_and_with_units() -> None:
    losses = [quantity("2 ms", "--loss-time", "s"), quantity("0.1 N*s/m^2", "--air-damping", "N*s/m^2")]
    np.testing.assert_allclose([*losses, ratio("3 %", "--damping")], [2e-3, 0.1, 0.03])
