"""The article's eleven errata, each with the computation that shows it."""

from __future__ import annotations

from sagline.article.errata_cable import (
    error_formula,
    printed_formulas,
    sag_constant,
    sign_in_bound,
    stretch_by_end_tension,
    table_number,
    vertical_and_level,
)
from sagline.article.errata_platform import euler_rates, gravity_twice, rank_of_h, sign_of_intercept
from sagline.article.erratum import Erratum
from sagline.core.numbers import n
from sagline.present.page import Chapter, Finding, Table, Verdict

DEMONSTRATIONS = (
    sign_of_intercept,
    gravity_twice,
    euler_rates,
    rank_of_h,
    stretch_by_end_tension,
    sag_constant,
    sign_in_bound,
    vertical_and_level,
    error_formula,
    table_number,
    printed_formulas,
)


def errata() -> tuple[Erratum, ...]:
    """All eleven, in the order of docs/errata.md."""
    return tuple(demonstrate() for demonstrate in DEMONSTRATIONS)


def errata_chapter() -> Chapter:
    """Each erratum with its demonstration."""
    return Chapter(
        "errata",
        "Errata",
        "Eleven slips in the article, each shown by a computation. None touches its idea; with them mended its closed "
        "form is good to a few millimeters.",
        tuple(_finding(erratum) for erratum in errata()),
    )


def _finding(erratum: Erratum) -> Finding:
    rows = [(number.label, n(number.value, ".5g", number.unit, size=number.size)) for number in erratum.numbers]
    return Finding(
        key=f"erratum-{erratum.number}",
        title=f"erratum {erratum.number}: {erratum.title[0].lower() + erratum.title[1:]}",
        statement=erratum.printed,
        measured=erratum.right,
        verdict=Verdict.ERRATUM,
        numbers={number.label: number.value for number in erratum.numbers},
        data=(Table("Computed", ("quantity", "value"), rows),),
    )
