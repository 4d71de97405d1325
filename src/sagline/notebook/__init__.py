"""HTML of robots, plans and results in Jupyter: a summary and a small figure, in the colors of the notebook."""

from __future__ import annotations

from contextlib import suppress
from html import escape

from sagline.present.summaries import summary_of

GOOD, BAD, NEITHER = "#009E73", "#D55E00", "#888888"


def html_of(thing: object) -> str | None:
    """HTML of the summary and the figure of `thing` for notebooks; None for other objects."""
    found = summary_of(thing)
    if found is None:
        return None
    color = NEITHER if found.good is None else GOOD if found.good else BAD
    lines = "\n".join(found.lines)
    rest = f'<pre style="margin:.3em 0;white-space:pre-wrap;background:none">{escape(lines)}</pre>' if lines else ""
    return (
        f'<div class="sagline" style="max-width:46em"><div style="border-left:4px solid {color};padding-left:.6em">'
        f"<strong>{escape(found.title)}</strong>: {escape(found.verdict)}{rest}</div>"
        f"{_figure_of(thing, f'{found.title}: {found.verdict}')}</div>"
    )


def _figure_of(thing: object, description: str) -> str:
    """HTML of the figure of `thing`; "" if there is no figure, or if drawing fails."""
    with suppress(Exception):  # without Matplotlib, for example; only the summary is then shown
        from sagline.notebook.figures import drawing_of

        return drawing_of(thing, description)
    return ""
