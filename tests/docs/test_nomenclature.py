"""Names of the nomenclature are names of the public surface or fields of its types."""

import re
from pathlib import Path

import sagline as sl

PAGE = Path(__file__).parents[2] / "docs" / "nomenclature.md"


def rows() -> list[list[str]]:
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines if line.startswith("| ")]
    return [row for row in cells if row[0] != "term"]


def test_every_term_is_listed_once() -> None:
    terms = [row[0] for row in rows()]
    assert len(terms) > 70
    assert sorted(set(terms)) == sorted(terms)


def test_every_name_exists() -> None:
    names = [name for row in rows() for name in re.findall(r"`([\w.]+)`", row[-1])]
    assert len(names) > 70
    for name in names:
        owner, _, field = name.partition(".")
        kind = getattr(sl, owner)
        known = {*dir(kind), *getattr(kind, "__annotations__", ())}
        assert not field or field in known, name
