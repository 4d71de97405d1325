"""Findings and chapters of the report; the texts are in data/report.toml, the numbers come from the studies."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from string import Formatter
from typing import Any

from sagline.core.numbers import n
from sagline.present.page import Chapter, Finding, Panel, Table, Verdict


class _Numbers(Formatter):
    """Formatter of numbers for readers: {extent:.3g mm}, {100*share:.1f %}, {errors[2]:.2f}; texts do not change."""

    def get_field(self, field_name: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> tuple[Any, Any]:
        """Value of a name; a factor before the name multiplies it."""
        factor, _, name = field_name.rpartition("*")
        value, key = super().get_field(name, args, kwargs)
        return (float(factor) * value if factor else value), key

    def format_field(self, value: Any, format_spec: str) -> str:
        """Text of a number, with the format and the unit of its field."""
        form, _, unit = format_spec.partition(" ")
        return n(value, form or ".4g", unit) if format_spec else str(value)


@cache
def _texts() -> dict[str, dict[str, Any]]:
    return tomllib.loads(files("sagline.article").joinpath("data/report.toml").read_text(encoding="utf-8"))


def finding(
    key: str,
    numbers: dict[str, Any] | None = None,
    *,
    verdict: Verdict | None = None,
    panels: Sequence[Panel] = (),
    data: Sequence[Table] = (),
    **words: Any,
) -> Finding:
    """Finding with a key; its texts use `numbers` and `words`; `numbers` are also saved."""
    entry, known = _texts()["findings"][key], numbers or {}
    statement, measured = (_Numbers().format(entry.get(part, ""), **{**known, **words}) for part in _PARTS)
    return Finding(
        key=key,
        title=entry["title"],
        statement=statement,
        measured=measured,
        verdict=Verdict[entry["verdict"]] if verdict is None else verdict,
        numbers=known,
        figures=tuple(entry.get("figures", ())),
        tables=tuple(entry.get("tables", ())),
        panels=tuple(panels),
        data=tuple(data),
    )


def chapter(key: str, findings: Sequence[Finding], **words: Any) -> Chapter:
    """Chapter with a key; its introduction uses `words`."""
    entry = _texts()["chapters"][key]
    return Chapter(key, entry["title"], _Numbers().format(entry["lead"], **words), tuple(findings))


_PARTS = ("statement", "measured")
