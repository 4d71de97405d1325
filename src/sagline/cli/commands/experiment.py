"""`sagline experiment`: the article's experiment, with a controller and a twin."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.options import JsonOption, OutOption


def experiment(
    which: Annotated[str, typer.Argument(metavar="NAME", help="article: ten points, Table 2 and figures 25-27.")],
    in_process: Annotated[
        bool,
        typer.Option("--in-process", help="Let the twin's clock wait: half a minute instead of 14, and no network."),
    ] = False,
    true: Annotated[
        str | None,
        typer.Option(
            metavar="ROBOT",
            help="The robot as it really is, where that is another one; the controller still knows article-prototype.",
            show_default=False,
        ),
    ] = None,
    seed: Annotated[str, typer.Option(metavar="NUMBER", help="Of the load cells' noise.")] = "1",
    out: OutOption = Path("output"),
    as_json: JsonOption = False,
) -> None:
    """Do an experiment again: home, the ten points of Table 2, home, as one page beside the article's numbers.

    The controller drives a twin of the prototype in another process, over S7 and in real time, which takes 14 minutes.
    Writes DIR/experiment.html, which needs nothing else, and DIR/experiment.json with the numbers.

    For example:

        sagline experiment article --in-process
        sagline experiment article
        sagline experiment article --in-process --true worn.yaml --out worn
    """
    from sagline.cli.experiment import Asked
    from sagline.cli.experiment import experiment as run

    run(which, Asked(in_process, true, seed, out, as_json))
