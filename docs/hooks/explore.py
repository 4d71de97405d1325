"""Sliders and table of docs/explore.md, and their replacement without JavaScript.

The line `<!-- one cable, to be moved -->` becomes the controls for docs/explore.js, and the line
`<!-- one cable, standing still -->` a table of the library's own numbers.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from sagline.cables.cable import Cable
from sagline.cables.model import CableModel, CableState
from sagline.cables.models import Catenary, Empirical
from sagline.kernels.cable.batch import BUFFERS, CHUNK
from sagline.share.calls import Call, described_calls, module_text

if TYPE_CHECKING:  # the tests load this without MkDocs
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files

KERNELS: Final = Path(__file__).parents[2] / "src/sagline/share/page/kernels.js"
MOVED, STILL = "<!-- one cable, to be moved -->", "<!-- one cable, standing still -->"
SPAN, RISE, DENSITY, STIFFNESS, GRAVITY = 12.0, -4.0, 0.067, 44e3, 9.81  # m, m, kg/m, N, m/s^2: the article's cable
TENSIONS: Final = (30.0, 100.0, 300.0, 1000.0)  # N, of the table
HEAVY, STANDING = 0.5, (20.0, 40.0, 200.0)  # kg/m and N, of the static picture
CURVE = 81  # points of a cable and of the curve that the scripts draw
POINTS, METER, LEFT, TOP = 60, 26.0, 24.0, 20.0  # of that picture: points per cable; px per meter, and of the frame end


class Slider(NamedTuple):
    """A control.

    Attributes:
        name: Name in docs/explore.js.
        label: Name of the quantity.
        unit: Printed unit.
        factor: Printed unit in SI units.
        base: Initial value, in the printed unit.
        ratio: Factor of a step; None for steps that are added to zero.
        low: Lowest step.
        high: Highest step.
    """

    name: str
    label: str
    unit: str
    factor: float
    base: float
    ratio: float | None
    low: float
    high: float

    @property
    def html(self) -> str:
        """The label, the slider and its value."""
        begin, step = (0, 1) if self.ratio else (self.base, 0.1)
        scale = f' data-base="{self.base:g}" data-ratio="{self.ratio:g}"' if self.ratio else ""
        return (
            f'<div><label for="explore-{self.name}">{self.label}</label><span class="value" aria-hidden="true"></span>'
            f'<input type="range" id="explore-{self.name}" name="{self.name}" min="{self.low:g}" max="{self.high:g}" '
            f'step="{step:g}" value="{begin:g}" data-unit="{self.unit}" data-factor="{self.factor:g}"{scale}></div>'
        )


SLIDERS: Final = (
    Slider("density", "Weight", "g/m", 1e-3, 1e3 * DENSITY, 1.05, -38, 41),
    Slider("stiffness", "Stiffness <i>EA</i>", "kN", 1e3, 1e-3 * STIFFNESS, 1.1, -22, 49),
    Slider("tension", "Tension along the chord", "N", 1.0, 100.0, 1.05, -33, 61),
    Slider("rise", "Height of the platform end", "m", 1.0, RISE, None, -5.0, 3.0),
)
TRIED: Final = {  # positions of the sliders for each button, in steps; other sliders return to zero
    "The article’s cable": {},
    "Heavy and slack": {"density": 41, "tension": -33},
    "Level": {"rise": 0.0, "tension": -20},
    "Soft": {"stiffness": -22, "tension": 61},
    "Steel, taut": {"density": 36, "stiffness": 30, "tension": 55},
}
QUANTITIES: Final = {  # name in docs/explore.js -> meaning
    "length": "unstrained length, m",
    "sag": "sag, mm",
    "vertical": "vertical force on the platform end, N",
    "frameEnd": "tension at the frame end, N",
    "platformEnd": "tension at the platform end, N",
}
NOTE: Final = "Outside the article’s range: the lowest point of the cable is inside the span."


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the script that calls kernels, shared with the pages of `sagline share`."""
    from mkdocs.structure.files import File

    files.append(File.generated(config, KERNELS.name, abs_src_path=str(KERNELS)))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Replace the marked lines of the page by the cable."""
    return markdown.replace(MOVED, moved()).replace(STILL, standing())


def moved() -> str:
    """Controls, hidden until the script runs, and the static picture that it hides."""
    constants = {"span": SPAN, "gravity": GRAVITY}
    data = "".join(f' data-{name}="{value:g}"' for name, value in constants.items())
    buttons = "".join(
        f"<button type=\"button\" data-steps='{json.dumps(steps)}'>{name}</button>" for name, steps in TRIED.items()
    )
    head = "".join(f'<th scope="col">{name}</th>' for name in ("", "exact", "article", "difference"))
    rows = "".join(
        f'<tr data-row="{name}"><th scope="row">{what}</th><td></td><td></td><td></td></tr>'
        for name, what in QUANTITIES.items()
    )
    pictures = "".join(
        f'<figure><svg data-picture="{name}" viewBox="0 0 360 310" role="img" aria-label="{what}"></svg>'
        f"<figcaption>{caption}</figcaption></figure>"
        for name, what, caption in (
            ("cable", "The exact cable and the article’s between frame and platform.", "The cable, to scale"),
            (
                "plane",
                "Vertical over horizontal force on the platform end: the article’s line and the exact curve.",
                "The force on the platform end while the tension changes",
            ),
        )
    )
    return (
        f'<div class="explore"{data}><div data-moves hidden>'
        f'<div class="sliders">{"".join(slider.html for slider in SLIDERS)}</div>'
        f'<div class="tried" role="group" aria-label="Cables to try">{buttons}</div>'
        '<p class="legend"><span class="exact">exact catenary</span> <span class="closed">the article’s line</span></p>'
        f'<div class="pictures">{pictures}</div>'
        f'<p role="status" class="heard"></p><p data-note="range" class="note">{NOTE}</p>'
        f'<table class="numbers"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'
        f"<div data-still>{still_picture()}</div></div>"
        f'<script type="text/plain" data-part="kernels">{module_text()}</script>'
        f'<script type="application/json" data-part="calls">{json.dumps(calls())}</script>'
        '<script src="kernels.js" defer></script><script src="explore.js" defer></script>'
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
        described[name] = "batch_from_tension", (terms, *given.values(), tension, *forces, status, work)
        state = (terms, *given.values(), *(each[:1] for each in (*forces, tension)))
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
