"""Chapter: the eleven errata."""

from __future__ import annotations

from sagline.article.errata import errata
from sagline.article.erratum import Erratum
from sagline.core.numbers import n
from sagline.report.blocks import Chapter, Finding, Table, Verdict


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
