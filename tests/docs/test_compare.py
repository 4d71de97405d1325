"""docs/compare.md: every fact about another program leads to a source, and those about sagline hold."""

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
OWN_TESTS = ("MuJoCo", "cdpyr")  # programs whose cells need no source: MuJoCo is run by tests
LABEL = re.compile(r"\[([CWMDPYIHGT]\d+(?:, [CWMDPYIHGT]\d+)*)\]")


def rows(head: str) -> dict[str, list[str]]:
    """The rows of the table that begins with this line, by their first cell."""
    table = FACTS[FACTS.index(head) :].split("\n\n")[0].splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in table[2:]]
    return {first: rest for first, *rest in cells}


FEATURES = rows("| | sagline | CASPR |")
NEAR = rows("| | sagline | MoorPy |")


def labels(text: str) -> list[str]:
    """Labels of sources in the text, also several in one bracket."""
    return [label for found in LABEL.findall(text) for label in found.split(", ")]


def test_every_source_is_named_and_used() -> None:
    used, named = set(labels(FACTS)), labels(SOURCES)
    assert used == set(named)
    assert len(named) == len(set(named))
    assert len(used) > 20


@pytest.mark.parametrize(("table", "programs"), [(FEATURES, LETTERS), (NEAR, NEIGHBORS)], ids=["robots", "neighbors"])
def test_what_is_said_of_another_program_has_a_source_of_that_program(
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


@extended  # it imports all of sagline
def test_what_is_said_of_sagline() -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert rows("| program |")["sagline"][0] == version
    said = [cells[0] for cells in (*FEATURES.values(), *NEAR.values())]
    counts = [int(count) for cell in said for count in re.findall(r"^(\d+) methods", cell)]
    assert counts == [count_of(sl.TensionMethod)] * 2
    assert [cell.split()[0] for cell in said if "four approximate" in cell] == ["exact"] * 2
    assert count_of(sl.CableModel) == 1 + 4


def count_of(base: type) -> int:
    """Number of public kinds of a class."""
    return sum(
        isinstance(each, type) and issubclass(each, base) and each is not base for each in public_values().values()
    )
