"""Checks of the page of an experiment."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from sagline.article.experiment import Experiment
from sagline.article.experiment_page import NAMES, experiment_chapter, write_experiment
from sagline.cli.main import app
from tests.article.test_report import NAMES as NO_NUMBERS
from tests.article.test_report import NUMBER, Page, is_among, leaves


def every_number_in_a_sentence_is_one_of_the_numbers_of_its_finding(whole: Experiment, tmp_path: Path) -> None:
    chapter = experiment_chapter(whole, "A twin.")
    write_experiment(whole, tmp_path / "numbers", "A twin.")
    written = json.loads((tmp_path / "numbers" / NAMES[1]).read_text())
    assert {number for f in chapter.findings for number in f.figures} == {25, 26, 27}
    told = 0
    for finding in chapter.findings:
        numbers = list(leaves(written[finding.key]))
        printed = NUMBER.findall(NO_NUMBERS.sub("", finding.measured))
        told += len(printed)
        assert [found for found in printed if not is_among(found[0], found[1], numbers)] == [], finding.measured
    assert told >= 12


def the_table_has_the_errors_of_the_article_and_of_the_run(whole: Experiment) -> None:
    (table,) = experiment_chapter(whole, "A twin.").findings[0].data
    assert [row[0] for row in table.rows] == [*whole.table.points, "mean"]
    for k, row in enumerate(table.rows[:-1]):
        assert float(row[3]) == pytest.approx(1e3 * whole.table.printed_error[k], abs=0.051)
        assert float(row[5]) == pytest.approx(1e3 * whole.distance[k], abs=0.00051)
    assert float(table.rows[-1][3]) == pytest.approx(18.4, abs=0.05)


def the_page_is_self_contained_and_its_numbers_are_in_a_file(whole: Experiment, tmp_path: Path) -> None:
    place = write_experiment(whole, tmp_path / "new", "A twin.")
    text = place.read_text()
    page = Page(text)
    assert (page.open, page.sources) == ([], [])
    assert all(link.startswith("#") for link in page.links)
    assert len(page.ids) == len(set(page.ids))
    assert page.counts["figure"] == 4
    numbers = json.loads((tmp_path / "new" / NAMES[1]).read_text())
    np.testing.assert_allclose(numbers["stops"]["distance_mm"], 1e3 * whole.distance, atol=1e-9)


def the_command_writes_the_page_and_prints_the_table(
    whole: Experiment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sagline.article.experiment.in_process", lambda *robots, **options: whole)
    words = ["experiment", "article", "--in-process", "--out", str(tmp_path)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.stderr
    lines = done.stdout.splitlines()
    rows = {line.split()[0]: line.split()[1:] for line in lines if line.split()}
    assert {*whole.table.points, "mean"} <= rows.keys()
    assert rows["mean"] == ["18.4", f"{1e3 * whole.distance.mean():.3f}"]
    assert max(map(len, lines)) <= 80
    assert "13.9 min" in lines[-1].replace("\u00a0", " ")
    done = CliRunner().invoke(app, [*words, "--json"])
    assert json.loads(done.stdout)["run"]["duration_min"] == pytest.approx(13.9, abs=0.05)
