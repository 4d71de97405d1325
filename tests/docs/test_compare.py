"""docs/compare.md: each statement on another program has a source, and the statements on sagline are true."""

import re
import tomllib
from pathlib import Path

import pytest

import sagline as sl
from tests.tiers import extended
from tools.size import public_values

ROOT = Path(__file__).parents[2]
FACTS, _, SOURCES = (ROOT / "docs" / "compare.md").read_text(encoding="utf-8").partition("\n## Sources\n")
LETTERS = {"CASPR": "C", "WireX": "W", "MuJoCo": "M", "cdpyr": "D"}
NEIGHBORS = {"MoorPy": "P", "MoorDyn": "Y", "IRMA": "I", "Hangprinter": "H", "GTDynamics": "G", "cdpr_simulator": "T"}
OWN_TESTS = ("MuJoCo", "cdpyr")  # programs whose cells need no source: tests run MuJoCo
LABEL = re.compile(r"\[([CWMDPYIHGT]\d+(?:, [CWMDPYIHGT]\d+)*)\]")


def rows(head: str) -> dict[str, list[str]]:
    """Rows by their first cell of the table that begins with the given line."""
    table = FACTS[FACTS.index(head) :].split("\n\n")[0].splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in table[2:]]
    return {first: rest for first, *rest in cells}


FEATURES = rows("| | sagline | CASPR |")
NEAR = rows("| | sagline | MoorPy |")


def labels(text: str) -> list[str]:
    """Labels of sources in the text; a bracket can contain several."""
    return [label for found in LABEL.findall(text) for label in found.split(", ")]


def test_every_source_is_named_and_used() -> None:
    used, named = set(labels(FACTS)), labels(SOURCES)
    assert used == set(named)
    assert len(named) == len(set(named))
    assert len(used) > 20


@pytest.mark.parametrize(("table", "programs"), [(FEATURES, LETTERS), (NEAR, NEIGHBORS)], ids=["robots", "neighbors"])
def test_statements_on_other_programs_have_a_source_of_that_program(
    table: dict[str, list[str]], programs: dict[str, str]
) -> None:
    told = 0
    for what, (_, *others) in table.items():
        for program, cell in zip(programs, others, strict=True):
            letters = {label[0] for label in labels(cell)}
            assert letters <= {programs[program]}, (what, program)
            if cell != "–" and program not in OWN_TESTS:
                assert letters, (what, program)
                told += 1
    assert told > 20


def test_every_program_has_a_version_and_a_task() -> None:
    versions, tasks = " ".join(rows("| program | version")), " ".join(row[0] for row in rows("| task | use |").values())
    assert not {name for name in (*LETTERS, *NEIGHBORS) if name not in versions}
    assert not {name for name in NEIGHBORS if name not in tasks}


@extended  # counts all modules of sagline
def test_statements_on_sagline_are_true() -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert rows("| program |")["sagline"][0] == version
    said = [cells[0] for cells in (*FEATURES.values(), *NEAR.values())]
    counts = [int(count) for cell in said for count in re.findall(r"^(\d+) methods", cell)]
    assert counts == [count_of(sl.TensionMethod)] * 2
    assert [cell.split()[0] for cell in said if "four approximate" in cell] == ["exact"] * 2
    assert count_of(sl.CableModel) == 1 + 4


def count_of(base: type) -> int:
    """Number of public subclasses of a class."""
    return sum(
        isinstance(each, type) and issubclass(each, base) and each is not base for each in public_values().values()
    )
