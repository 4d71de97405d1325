"""What shows itself in a notebook."""

from __future__ import annotations

from contextlib import suppress
from importlib import import_module

# The ring that draws is far out, and loads when something is shown, by its name: an import would close a circle here.
_PAGES = "sagline.notebook.html"


class Shown:
    """Something that Jupyter shows with its verdict and a figure; elsewhere it is its ordinary text."""

    __slots__ = ()

    def _repr_html_(self) -> str | None:
        """The verdict, and a figure inside; None, whereupon the ordinary text is shown, where there is nothing more."""
        with suppress(Exception):  # a notebook's cell has done its work: how that looks must not spoil it
            shown: str | None = import_module(_PAGES).html_of(self)
            return shown
        return None
