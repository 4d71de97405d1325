"""The article's eleven errata, each with the computation that shows it."""

from __future__ import annotations

from sagline.article.errata_cables import sag_constant, sign_in_bound, stretch_by_end_tension, vertical_and_level
from sagline.article.errata_print import error_formula, printed_formulas, table_number
from sagline.article.errata_statics import euler_rates, gravity_twice, rank_of_h, sign_of_intercept
from sagline.article.erratum import Erratum

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
    """All eleven, in the order of docs/errata.md.

    Returns:
        The errata, each with what the article prints beside what is computed.
    """
    return tuple(demonstrate() for demonstrate in DEMONSTRATIONS)
