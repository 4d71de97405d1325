"""docs/compare.md: every fact about another program leads to a source, and those about sagline hold."""

import re
import tomllib
from pathlib import Path

import sagline as sl
from tests.tiers import extended
from tools.size import public_values

ROOT = Path(__file__).parents[2]
FACTS, _, SOURCES = (ROOT / "docs" / "compare.md").read_text(encoding="utf-8").partition("\n## Sources\n")
LETTERS = {"CASPR": "C", "WireX": "W", "MuJoCo": "M", "cdpyr": "D"}
NUMBER = re.compile(r"\[([CWMD]\d+)\]")


def rows(head: str) -> dict[str, list[str]]:
    """The rows of the table that begins with this line, by their first cell."""
    table = FACTS[FACTS.index(head) :].split("\n\n")[0].splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in table[2:]]
    return {first: rest for first, *rest in cells}


FEATURES = rows("| | sagline |")


def test_every_source_is_named_and_used() -> None:
    used, named = set(NUMBER.findall(FACTS)), NUMBER.findall(SOURCES)
    assert used == set(named)
    assert len(named) == len(set(named))
    assert len(used) > 20


def test_what_is_said_of_another_program_has_a_source_of_that_program() -> None:
    told = 0
    for what, (_, *others) in FEATURES.items():
        for program, cell in zip(LETTERS, others, strict=True):
            letters = {number[0] for number in NUMBER.findall(cell)}
            assert letters <= {LETTERS[program]}, (what, program)
            if cell != "–" and program in ("CASPR", "WireX"):
                assert letters, (what, program)
                told += 1
    assert told > 20


@extended  # it imports all of sagline
def test_what_is_said_of_sagline() -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert rows("| program |")["sagline"][0] == version
    said = [cells[0] for cells in FEATURES.values()]
    counts = [int(count) for cell in said for count in re.findall(r"^(\d+) methods", cell)]
    assert counts == [count_of(sl.TensionMethod)]
    assert [cell.split()[0] for cell in said if "four approximate" in cell] == ["exact"]
    assert count_of(sl.CableModel) == 1 + 4


def count_of(base: type) -> int:
    """Number of public kinds of a class."""
    return sum(
        isinstance(each, type) and issubclass(each, base) and each is not base for each in public_values().values()
    )
