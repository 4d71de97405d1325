"""The command of the experiment: what it refuses. What it writes is looked at where the experiment is run."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from sagline.cli.main import app


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["artikle"], "experiment is 'artikle'; allowed: article. Did you mean article?"),
        (["article", "--true", "falcon-7"], "--true is a robot of 7 cables; allowed: 8."),
        (["article", "--true", "cogiro"], "counts_per_turn is not given"),
        (["article", "--true", "nothere.yaml"], "nothere.yaml"),
        (["article", "--seed", "x"], "--seed"),
        (["article", "--out", "/dev/null/x"], "/dev/null"),
    ],
)
def test_bad_input_is_refused_in_one_line(words: list[str], message: str, tmp_path: Path) -> None:
    out = [] if "--out" in words else ["--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, ["experiment", *words, "--in-process", *out])
    assert (done.exit_code, done.stdout) == (2, "")
    assert message in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()
