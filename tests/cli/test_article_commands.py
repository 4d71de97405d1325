"""`sagline article` and `sagline identify`."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from tests.tiers import extended


def sagline(*words: str) -> Any:
    return CliRunner().invoke(app, words)


@pytest.fixture
def measurements(tmp_path: Path) -> Path:
    random = np.random.default_rng(3)
    span, rise = random.uniform(2.0, 12.0, 50), random.uniform(-4.0, 2.0, 50)
    cable = sl.Cable(0.067, 44e3)
    state = sl.Catenary().from_tension(cable, span, rise, random.uniform(20.0, 600.0, 50))
    columns = (
        span,
        1e3 * rise,
        state.unstrained_length + random.normal(0.0, 1e-3, 50),
        state.frame_end_tension + random.normal(0.0, 1.0, 50),
    )
    file = tmp_path / "cable.csv"
    rows = "\n".join(",".join(f"{x:.6f}" for x in row) for row in zip(*columns, strict=True))
    file.write_text(f"span [m],rise [mm],length [m],tension [N]\n{rows}\n")
    return file


def test_article_writes_the_requested_files(tmp_path: Path) -> None:
    result = sagline("article", "figure", "3", "--out", str(tmp_path))
    assert result.exit_code == 0, result.output
    assert sorted(file.name for file in tmp_path.iterdir()) == ["article.html", "article.json"]
    assert "Figure 3:" in (tmp_path / "article.html").read_text()
    assert "1 × holds" in result.stderr


@extended
def test_article_prints_its_numbers(tmp_path: Path) -> None:
    result = sagline("article", "figure", "3", "--out", str(tmp_path), "--json")
    assert json.loads(result.stdout) == json.loads((tmp_path / "article.json").read_text())


def test_an_unknown_part_is_bad_input(tmp_path: Path) -> None:
    result = sagline("article", "figure", "99", "--out", str(tmp_path / "new"))
    assert result.exit_code == 2
    assert not (tmp_path / "new").exists()


def test_identify_finds_the_cable_and_its_empirical_model(measurements: Path) -> None:
    found = json.loads(sagline("identify", str(measurements), "--json").stdout)
    for name, value in (("linear_density", 0.067), ("axial_stiffness", 44e3)):
        assert abs(found["values"][name] - value) < 4.0 * found["standard_errors"][name]
    assert found["warnings"] == []
    assert found["chi_squared"] == pytest.approx(1.0, abs=0.4)
    assert found["empirical"]["k_h"]["value"] == pytest.approx(4.88, abs=0.1)
    assert 20.0 < found["empirical"]["tension_min_N"] < 400.0


def test_identify_prints_its_results(measurements: Path) -> None:
    result = sagline("identify", str(measurements), "--offset")
    assert result.exit_code == 0, result.output
    for word in ("linear_density", "axial_stiffness", "length_offset", "k_h", "k_p", "kg/m", "chi-squared"):
        assert word in result.stdout
