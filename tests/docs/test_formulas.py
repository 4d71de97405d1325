"""Formulas of the pages are between dollar signs, and `make docs` fails if one of them cannot be typeset."""

import re
from pathlib import Path

import pytest

from tools.pages.formulas import CODE, FORMULA

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
UNIT = r"(?<!\bm)(?<!mm)(?<!/s)"
UNSET = re.compile(rf"[α-λν-ωΓΔΘΛΞΣΦΨΩ∂√∑∫]|\b[A-Za-z]_[A-Za-z0-9]|{UNIT}[²³⁴⁻¹ᵏᵀ₀₁ᵢ]|\w\^|\\[a-z]+")


def unset(text: str) -> list[str]:
    """Text in prose that looks like a formula, with its surroundings."""
    prose = FORMULA.sub("", CODE.sub("", text))
    found = [prose[max(0, match.start() - 20) : match.end() + 20] for match in UNSET.finditer(prose)]
    return found + ["$"] * prose.count("$")


def name_of(page: Path) -> str:
    return str(page.relative_to(DOCS))


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_formula_is_typeset(page: Path) -> None:
    assert unset(page.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_no_formula_breaks_a_table(page: Path) -> None:
    formulas = FORMULA.finditer(CODE.sub("", page.read_text(encoding="utf-8")))
    assert [formula[0] for formula in formulas if "|" in formula[0]] == []


@pytest.mark.parametrize("text", ["τ = T/cos φ", "the T_x of", "g²/24", "10^6 poses", "a \\frac12", "$5 for", "HᵀH"])
def test_a_formula_that_is_not_typeset_is_found(text: str) -> None:
    assert unset(f"Here {text} there")


@pytest.mark.parametrize("text", ["5 kg m² or 3 m/s² or 4 mm²", "25 µs", "`T_x`", "$T_x$ and $\\tau$", "$$\nx^2\n$$"])
def test_units_and_code_are_not_taken_for_formulas(text: str) -> None:
    assert unset(text) == []
