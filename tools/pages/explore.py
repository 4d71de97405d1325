"""Kernels for the sliders of docs/explore.md, and a picture and a table that need no JavaScript.

The lines `<!-- one cable, ... -->` of the page become these parts; `MADE` lists them.
"""

from __future__ import annotations

import json
import re
from typing import Any, Final

import numpy as np

from sagline.cables.cable import Cable
from sagline.cables.model import CableModel, CableState
from sagline.cables.models import Catenary, Empirical
from sagline.kernels.tables import BUFFERS, CHUNK
from sagline.share.packing import Call, described_calls, module_text

MARK: Final = re.compile(r"^<!-- one cable, (.+) -->$", re.MULTILINE)
SPAN, RISE, DENSITY, STIFFNESS, GRAVITY = 12.0, -4.0, 0.067, 44e3, 9.81  # m, m, kg/m, N, m/s^2: the article's cable
TENSIONS: Final = (30.0, 100.0, 300.0, 1000.0)  # N, of the table
HEAVY, STANDING = 0.5, (20.0, 40.0, 200.0)  # kg/m and N, of the static picture
CURVE = 81  # points of a cable and of the curve that the scripts draw
POINTS, METER, LEFT, TOP = 60, 26.0, 24.0, 20.0  # of that picture: points per cable; px per meter, and of the frame end


def with_cable(page: str) -> str:
    """A page with the numbers and pictures of the cable in place of the marked lines."""
    return MARK.sub(lambda found: MADE[found[1]](), page)


def kernels() -> str:
    """The compiled kernels and their calls, for docs/explore.js."""
    return (
        f'<script type="text/plain" data-part="kernels">{module_text()}</script>\n'
        f'<script type="application/json" data-part="calls">{json.dumps(calls())}</script>'
    )


def calls() -> dict[str, Any]:
    """Calls of the kernels for docs/explore.js: cables at tensions by both models, sag and points of the first."""
    given = dict(zip(("span", "rise", "density", "stiffness"), np.zeros((4, 1)), strict=True))
    found = dict(zip(("tension", "length", "horizontal", "vertical"), np.zeros((4, CURVE)), strict=True))
    status, sag, points = np.zeros(CURVE, dtype=np.int8), np.zeros(1), np.zeros((1, CURVE, 2))
    tension, length, horizontal, vertical = found.values()
    forces, work = (length, horizontal, vertical), np.zeros((BUFFERS, CHUNK))
    described: dict[str, Call] = {}
    for name, model in (("exact", Catenary()), ("empirical", Empirical())):
        terms = model.terms(GRAVITY)
        described[name] = "batch_from_tension", (terms, (*given.values(), tension), (*forces, status), work)
        state = terms, (*given.values(), *(each[:1] for each in (*forces, tension)))
        described[f"{name}Sag"] = "largest_sags", (*state, sag)
        described[f"{name}Points"] = "shape_points", (*state, points)
    return described_calls(described, {**given, **found, "status": status, "sag": sag, "points": points})


def still_picture() -> str:
    """Picture of a heavy cable at three tensions, exact and by the article's form."""
    drawn = []
    for tension in STANDING:
        for model, kind in ((Catenary(), "exact"), (Empirical(), "closed")):
            places = hung(model, tension, HEAVY).points(POINTS)
            way = "L".join(f"{LEFT + METER * x:.1f} {TOP - METER * z:.1f}" for x, z in places)
            drawn.append(f'<path class="{kind}" d="M{way}"/>')
    named = ", ".join(f"{tension:g}" for tension in STANDING)
    caption = (
        f"A cable of {1e3 * HEAVY:g} g/m and {1e-3 * STIFFNESS:g} kN over {SPAN:g} m at {named} N, to scale: exact "
        "solid, the article’s dashed. The sliders of this page need JavaScript; the table below does not."
    )
    picture = f'<svg viewBox="0 0 360 240" role="img" aria-label="{caption}">{"".join(drawn)}</svg>'
    return f'<figure class="still">{picture}<figcaption>{caption}</figcaption></figure>'


def standing() -> str:
    """Table of both models at some tensions."""
    head = "| tension, N | exact length, m | article, m | difference, mm | exact sag, mm | article, mm |"
    rows = [head, "|---|---|---|---|---|---|"]
    for tension in TENSIONS:
        exact, closed = hung(Catenary(), tension), hung(Empirical(), tension)
        lengths = float(exact.unstrained_length), float(closed.unstrained_length)
        difference = f"{1e3 * (lengths[1] - lengths[0]):+.1f}".replace("-", "−")
        sags = f"{1e3 * float(exact.sag):.1f} | {1e3 * float(closed.sag):.1f}"
        rows.append(f"| {tension:g} | {lengths[0]:.4f} | {lengths[1]:.4f} | {difference} | {sags} |")
    return "\n".join(rows)


def hung(model: CableModel, tension: float, density: float = DENSITY) -> CableState:
    """The article's cable, or one of another density [kg/m], at a chord tension [N]."""
    return model.from_tension(Cable(density, STIFFNESS), SPAN, RISE, tension, GRAVITY)


MADE: Final = {"at three tensions": still_picture, "computed by these kernels": kernels, "standing still": standing}
