"""Which parts of the report are asked for: "figures 6-9", "table 2", "errata"."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from importlib import import_module
from typing import NamedTuple

from sagline.core.errors import InvalidValueError
from sagline.report.blocks import Chapter

_numbers = re.compile(r"(\d+)(?:-(\d+))?")


class Part(NamedTuple):
    """A chapter that can be asked for.

    Attributes:
        key: Its name.
        figures: The article's figures that it redoes.
        tables: The article's tables that it redoes.
        module: Where it is built; loaded only when it is.
        function: The function that builds it.
    """

    key: str
    figures: tuple[int, ...]
    tables: tuple[int, ...]
    module: str
    function: str

    def build(self) -> Chapter:
        """Do the studies and draw."""
        function: Callable[[], Chapter] = getattr(import_module(f"sagline.report.{self.module}"), self.function)
        return function()


PARTS = (
    Part("feasible-sets", (3, 4, 5), (), "feasible", "feasible_chapter"),
    Part("intercept", (6, 7), (), "constants", "intercept_chapter"),
    Part("sag", tuple(range(8, 16)), (), "sag", "sag_chapter"),
    Part("constants", (), (), "constants", "constants_chapter"),
    Part("identify", (), (), "identify", "identify_chapter"),
    Part("models", (), (), "models", "models_chapter"),
    Part("simulation", tuple(range(17, 23)), (), "simulation", "simulation_chapter"),
    Part("poses", (25, 26, 27), (2,), "poses", "poses_chapter"),
    Part("workspace", (), (), "workspace", "workspace_chapter"),
    Part("errata", (), (), "errata", "errata_chapter"),
)
REDONE = "3-15, 17-22 and 25-27; the others are drawings and photographs without data"


@dataclass(frozen=True, slots=True, eq=False)
class Selection:
    """What was asked for.

    Attributes:
        whole: Keys of chapters that are wanted whole.
        figures: Numbers of figures that are wanted.
        tables: Numbers of tables that are wanted.
    """

    whole: frozenset[str]
    figures: frozenset[int]
    tables: frozenset[int]

    @property
    def parts(self) -> tuple[Part, ...]:
        """The chapters that have something to build."""
        return tuple(
            p for p in PARTS if p.key in self.whole or self.figures & {*p.figures} or self.tables & {*p.tables}
        )

    def cut(self, chapter: Chapter) -> Chapter:
        """What of a chapter is wanted."""
        if chapter.key in self.whole:
            return chapter
        kept = (f for f in chapter.findings if self.figures & {*f.figures} or self.tables & {*f.tables})
        return replace(chapter, findings=tuple(kept))


def selection(words: Sequence[str]) -> Selection:
    """Read what is asked for; nothing means everything.

    Args:
        words: Chapter keys, "figures" or "tables" followed by numbers and ranges such as 6-9.

    Raises:
        InvalidValueError: If a word is none of these, or a figure has no data.
    """
    if not words:
        return Selection(frozenset(part.key for part in PARTS), frozenset(), frozenset())
    whole: set[str] = set()
    wanted: dict[str, set[int]] = {"figures": set(), "tables": set()}
    kind, open_word = "figures", ""
    for word in (w for text in words for w in text.replace(",", " ").split()):
        lower = word.lower()
        if lower.removesuffix("s") in {"figure", "table"}:
            kind = open_word = f"{lower.removesuffix('s')}s"
        elif found := _numbers.fullmatch(word):
            wanted[kind] |= _checked_range(kind, word, int(found[1]), int(found[2] or found[1]))
            open_word = ""
        elif lower in {part.key for part in PARTS}:
            whole.add(lower)
        else:
            raise _unknown(word)
    if open_word:
        raise InvalidValueError(open_word, "without numbers", f"{open_word} 6-9", "Give the numbers after it.")
    return Selection(frozenset(whole), frozenset(wanted["figures"]), frozenset(wanted["tables"]))


def _checked_range(kind: str, word: str, first: int, last: int) -> set[int]:
    known = {number for part in PARTS for number in getattr(part, kind)}
    numbers = set(range(first, last + 1)) if last < 100 else set()
    if not numbers & known:
        allowed = REDONE if kind == "figures" else "2; Table 1 is in the presets"
        raise InvalidValueError(f"{kind} {word}", "not redone here", allowed, "Ask for one of these.")
    return numbers & known


def _unknown(word: str) -> InvalidValueError:
    keys = [part.key for part in PARTS]
    near = get_close_matches(word.lower(), [*keys, "figures", "tables"], n=1)
    step = f"Did you mean {near[0]}?" if near else "Or give nothing, for everything."
    return InvalidValueError("part", repr(word), f"{', '.join(keys)}, figures N-M, table 2", step)
