"""What a report consists of: chapters of findings, each with a statement, a measurement, panels and tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, NamedTuple


class Verdict(StrEnum):
    """How a statement of the article fares."""

    HOLDS = "holds"
    HOLDS_WITHIN = "holds within limits"
    FAILS = "does not hold"
    OPEN = "cannot be decided"
    ERRATUM = "erratum"
    OURS = "not in the article"


class Panel(NamedTuple):
    """One drawing.

    Attributes:
        svg: The drawing as text.
        caption: What is to be seen.
    """

    svg: str
    caption: str


class Table(NamedTuple):
    """A table of texts.

    Attributes:
        caption: What it holds.
        head: Column heads with units.
        rows: The cells; the first of each row names it.
    """

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True, slots=True, eq=False)
class Finding:
    """One thing the article says or shows, beside what we measured.

    Attributes:
        key: Anchor in the page and key of its numbers: letters, digits and hyphens.
        figures: Numbers of the article's figures that it redoes.
        tables: Numbers of the article's tables that it redoes.
        title: A few words.
        statement: What the article says, with figure or equation; empty where it says nothing.
        measured: What we found.
        verdict: How the statement fares.
        panels: Drawings.
        data: Tables.
        numbers: The numbers behind it, plain: they go into the JSON file.
    """

    key: str
    title: str
    statement: str
    measured: str
    verdict: Verdict
    numbers: dict[str, Any]
    figures: tuple[int, ...] = ()
    tables: tuple[int, ...] = ()
    panels: tuple[Panel, ...] = ()
    data: tuple[Table, ...] = field(default=())


@dataclass(frozen=True, slots=True, eq=False)
class Chapter:
    """A part of the report.

    Attributes:
        key: Name by which it can be asked for.
        title: Its heading.
        lead: What it is about.
        findings: What was found.
    """

    key: str
    title: str
    lead: str
    findings: tuple[Finding, ...]
