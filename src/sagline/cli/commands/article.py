"""`sagline article` and `sagline identify`: what is found out about cables."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.choices import TensionPlace
from sagline.cli.options import JsonOption, OutOption


def article(
    parts: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="PART",
            help="figures N-M, table 2, or a chapter: feasible-sets, intercept, sag, constants, identify, models, "
            "simulation, poses, workspace, errata. Default: everything.",
        ),
    ] = None,
    out: OutOption = Path("output"),
    as_json: JsonOption = False,
) -> None:
    """Redo the article's figures, tables and errata, as one page: what it says beside what is computed.

    Writes DIR/article.html, which needs nothing else, and DIR/article.json with the numbers.

    For example:

        sagline article
        sagline article figures 6-9 --out results
        sagline article errata table 2
    """
    from sagline.cli.article import write_report

    write_report(out, parts or [], as_json=as_json)


def identify(
    file: Annotated[
        Path, typer.Argument(metavar="CSV", help="Columns span, rise, length, tension; units in brackets: span [mm].")
    ],
    length_error: Annotated[
        str, typer.Option(metavar="LENGTH", help="Standard error of a length, 0.002 or '2 mm'.")
    ] = "0.001",
    tension_error: Annotated[str, typer.Option(metavar="FORCE", help="Standard error of a tension, 5 or '5 N'.")] = "1",
    tension_at: Annotated[
        TensionPlace,
        typer.Option(
            metavar="PLACE", help=f"Where the tension is measured: {', '.join(each.value for each in TensionPlace)}."
        ),
    ] = TensionPlace.FRAME_END,
    offset: Annotated[
        bool, typer.Option("--offset/--no-offset", help="Find the zero of the lengths too, as one more unknown.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Find what a measured cable weighs and how stiff it is, and the empirical model for it.

    Standard errors and warnings say what the measurements do not determine or cannot tell apart.

    For example:

        sagline identify cable.csv
        sagline identify cable.csv --length-error "2 mm" --tension-at platform-end --offset
    """
    from sagline.cli.identify import identify as run

    unknowns = ["linear_density", "axial_stiffness", *["length_offset"] * offset]
    run(file, length_error, tension_error, tension_at.key, unknowns, as_json=as_json)
