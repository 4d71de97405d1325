"""Tables of the controller's states, faults and blocks, and a diagram of the states, made from the library.

The line `<!-- of the controller: states -->` of a page becomes the table of that name.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from sagline.control.faults import FAULT_TABLE
from sagline.control.states import TABLE, State
from sagline.plc.blocks import BLOCKS, Field

MARK = re.compile(r"^<!-- of the controller: (\w+) -->$", re.MULTILINE)
PLACES: Final = {  # column and row of each state
    State.OFF: (0, 0),
    State.CONNECTING: (1, 0),
    State.READY: (2, 0),
    State.EMERGENCY: (0, 1),
    State.FAULT: (1, 1),
    State.HOMING: (2, 1),
    State.STOPPING: (1, 2),
    State.IDLE: (2, 2),
    State.PAUSING: (0, 3),
    State.MOVING: (1, 3),
    State.JOGGING: (2, 3),
}
COLUMN, LINE, WIDE, HIGH, EDGE = 190.0, 96.0, 124.0, 36.0, 24.0  # px
IN_WORDS: Final = (State.STOPPING, State.EMERGENCY, State.OFF)  # targets of most states: without arrows


def with_tables(page: str) -> str:
    """A page with the tables in place of the marked lines."""
    return MARK.sub(lambda found: MADE[found[1]](), page)


def states() -> str:
    """Table of the states with the action of the winches and the transitions."""
    rows = (
        f"| `{state.name}` | {winches} | {'; '.join(f'`{to.name}`: {condition}' for to, condition in exits.items())} |"
        for state, (winches, exits) in TABLE.items()
    )
    return "\n".join(("| state | winches | leads to |", "|---|---|---|", *rows))


def picture() -> str:
    """Diagram of the states and transitions; targets of most states as text."""
    ways = {(state, to) for state, (_, exits) in TABLE.items() for to in exits if to not in IN_WORDS}
    drawn = "".join(_arrow(*way, way[::-1] in ways) for way in sorted(ways))
    boxes = "".join(_box(state) for state in PLACES)
    width, height = 2 * COLUMN + WIDE + 4 * EDGE, 3 * LINE + HIGH + 2 * EDGE
    head = '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
    tip = f'{head}<path d="M0 0 8 4 0 8z" fill="currentColor"/></marker></defs>'
    label = "The states of the controller and their transitions; the table below has the same content."
    svg = f'<svg class="states" viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{label}">'
    words = "\n".join(f"- to `{state.name}`: {', '.join(_sources(state))}" for state in IN_WORDS)
    return f"{svg}{tip}{drawn}{boxes}</svg>\n\nTransitions from most states, not drawn:\n\n{words}"


def _sources(to: State) -> Iterator[str]:
    return (f"`{state.name}`" for state, (_, exits) in TABLE.items() if to in exits)


def _middle(state: State) -> tuple[float, float]:
    column, line = PLACES[state]
    return EDGE + WIDE / 2 + COLUMN * column, EDGE + HIGH / 2 + LINE * line


def _box(state: State) -> str:
    x, y = _middle(state)
    box = f'<rect x="{x - WIDE / 2:g}" y="{y - HIGH / 2:g}" width="{WIDE:g}" height="{HIGH:g}" rx="6"/>'
    return f'{box}<text x="{x:g}" y="{y:g}">{state.name}</text>'


def _arrow(start: State, end: State, both_ways: bool) -> str:
    """Arrow between two states, beside the arrow back if there is one, around states in between."""
    (x, y), (to_x, to_y) = _middle(start), _middle(end)
    if x == to_x and abs(to_y - y) > LINE:
        side = x + WIDE / 2
        bend = side + 2.5 * EDGE
        return f'<path d="M{side:g} {y:g}C{bend:g} {y:g} {bend:g} {to_y:g} {side:g} {to_y:g}" marker-end="url(#tip)"/>'
    length = ((to_x - x) ** 2 + (to_y - y) ** 2) ** 0.5
    aside = 7.0 if both_ways else 0.0
    off_x, off_y = -aside * (to_y - y) / length, aside * (to_x - x) / length
    room = 4.0 + aside * (y != to_y) * (x != to_x)
    share = min(_half(WIDE + room, to_x - x), _half(HIGH + room, to_y - y))
    points = (x + share * (to_x - x), y + share * (to_y - y), to_x - share * (to_x - x), to_y - share * (to_y - y))
    first = f"M{points[0] + off_x:.1f} {points[1] + off_y:.1f}"
    return f'<path d="{first}L{points[2] + off_x:.1f} {points[3] + off_y:.1f}" marker-end="url(#tip)"/>'


def _half(size: float, distance: float) -> float:
    """Share of a distance within a box of a given size around its start."""
    return 0.5 * size / abs(distance) if distance else float("inf")


def faults() -> str:
    """Table of the faults with rule, reaction and time."""
    rows = (f"| {row.name} | {_plain(row.rule)} | {row.to} | {row.within} | {row.by} |" for row in FAULT_TABLE)
    return "\n".join(("| fault | condition | leads to | within | detected by |", "|---|---|---|---|---|", *rows))


def blocks() -> str:
    """Table of all values of the data blocks, with type and offset."""
    return "\n\n".join(
        f"`DB{block.number}`, `{block.name}`, {block.size} bytes:\n\n" + "\n".join((*HEAD, *_rows(block.fields)))
        for block in BLOCKS
    )


def _rows(fields: tuple[Field, ...], indent: str = "") -> Iterator[str]:
    for field in fields:
        kind = field.type if isinstance(field.type, str) else "a structure each"
        yield f"| {indent}`{field.name}` | {kind} | {indent}{field.offset} | {field.meaning} |"
        if not isinstance(field.type, str):
            yield from _rows(field.type, "+ ")


def _plain(text: str) -> str:
    """A rule as a cell of a table."""
    return text.replace("|", "\\|")


HEAD: Final = ("| name | type | byte | meaning |", "|---|---|---|---|")
MADE: Final = {"blocks": blocks, "faults": faults, "picture": picture, "states": states}
