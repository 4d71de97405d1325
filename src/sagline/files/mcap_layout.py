"""What stands where in a log in MCAP: its topics, their schemas, its attachments."""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib.metadata import version
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.control.events import Event, EventKind
from sagline.control.states import State

NANO: Final = 1e9  # of the log's own clock in a second
FORMAT: Final = 1  # raised whenever an older sagline could misread a log
SOURCE: Final = f"sagline {version('sagline')}"
CYCLE, RECORD, EVENT, TF, SCENE, TRUTH = "/cycle", "/record", "/event", "/tf", "/scene", "/truth"
HEAD: Final = "sagline.json"  # attachment: format, period, robot
PLAN: Final = "plan-{}.sagline"  # attachment: a packed data set
END: Final = "plan-{}-end.json"  # attachment: status and reason
PACKED: Final = "application/x-sagline-columns"
JSON: Final = "application/json"
SHARE_TF, SHARE_SCENE = 10, 100  # one of so many cycles
PER_METER: Final = 1e3  # mm


class Shown(NamedTuple):
    """A quantity of `/cycle`, of which people need not all digits: `/record` has them.

    Attributes:
        digits: Behind the point.
        unit: Its unit.
        what: What it is.
        several: Whether it is a list.
    """

    digits: int
    unit: str
    what: str
    several: bool = False


SHOWN: Final = {
    "time": Shown(2, "s", "on the clock of the link"),
    "late": Shown(4, "s", "by how much the cycle began too late"),
    "clock": Shown(2, "s", "where on the plan, from its start"),
    "position": Shown(5, "m", "of the platform's origin, estimated from the encoders", True),
    "tension": Shown(1, "N", "at the frame ends, as the load cells read it", True),
    "planned_tension": Shown(1, "N", "the same as planned", True),
    "length_error": Shown(2, "mm", "length that is asked for less that of the encoder", True),
    "correction": Shown(2, "mm", "what the tension loop has in the lengths", True),
}


def _schema(title: str, properties: dict[str, Any]) -> bytes:
    return json.dumps({"title": title, "type": "object", "properties": properties}).encode()


def _number(shown: Shown) -> dict[str, Any]:
    """Schema of a quantity of a cycle."""
    said = {"description": f"{shown.what} [{shown.unit}]"}
    return {"type": "array", "items": {"type": "number"}, **said} if shown.several else {"type": "number", **said}


_TEXT: Final = {"type": "string"}
SCHEMAS: Final = {
    CYCLE: _schema("sagline.Cycle", {"state": _TEXT, **{name: _number(shown) for name, shown in SHOWN.items()}}),
    EVENT: _schema(
        "sagline.Event",
        {
            "time": {"type": "number", "description": "[s]"},
            "cycle": {"type": "integer"},
            **dict.fromkeys(("kind", "name", "state", "text"), _TEXT),
        },
    ),
    TRUTH: _schema(
        "sagline.Truth",
        {
            "time": _number(Shown(0, "s", "on the clock of the twin")),
            "position": _number(Shown(0, "m", "of the platform's origin", True)),
            "quaternion": _number(Shown(0, "1", "rotation from platform to world, scalar last", True)),
        },
    ),
}


def head_of(robot: str, period: float) -> bytes:
    """The attachment that says what a log is of.

    Args:
        robot: Text of the robot's file.
        period: Of a cycle [s].
    """
    return json.dumps({"sagline_log_format": FORMAT, "source": SOURCE, "period": period, "robot": robot}).encode()


def cycle_texts(columns: dict[str, NDArray[Any]]) -> Iterator[bytes]:
    """Messages of cycles, for people.

    Args:
        columns: What there is of N cycles.

    Yields:
        N messages.
    """
    away = PER_METER * (columns["set_length"] - columns["length"] - columns["zero"])
    there = {**columns, "length_error": away, "correction": PER_METER * columns["correction"]}
    kept = {name: _listed(np.round(there[name], shown.digits)) for name, shown in SHOWN.items()}
    states = [State(code).name for code in columns["state"].tolist()]
    rows = zip(states, *kept.values(), strict=True)
    names = ("state", *kept)
    for row in rows:
        yield _text({name: value for name, value in zip(names, row, strict=True) if value is not None})


def event_text(event: Event) -> bytes:
    """Message of an event, without loss."""
    return _text({**event._asdict(), "kind": event.kind.value, "state": event.state.name})


def event_of(text: bytes) -> Event:
    """The event of a message.

    Raises:
        ValueError: If it is none.
    """
    try:
        said = json.loads(text)
        kind, state = EventKind(said["kind"]), State[said["state"]]
        return Event(float(said["time"]), int(said["cycle"]), kind, str(said["name"]), state, str(said["text"]))
    except (KeyError, TypeError) as error:
        raise ValueError(f"no event ({error})") from None


def truth_text(time: float, position: Any, quaternion: Any) -> bytes:
    """Message of where the platform really is, without loss."""
    return _text({"time": time, "position": position.tolist(), "quaternion": quaternion.tolist()})


def _listed(values: NDArray[Any]) -> list[Any]:
    """Values as JSON knows them: None for what is no number, and for rows of nothing else."""
    known = np.isfinite(values)
    if known.all():
        return list(values.tolist())
    rows: list[Any] = np.where(known, values.astype(object), None).tolist()  # type: ignore[call-overload]
    return rows if values.ndim == 1 else [row if there else None for row, there in zip(rows, known.any(1), strict=True)]


def _text(said: dict[str, Any]) -> bytes:
    return json.dumps(said, separators=(",", ":"), ensure_ascii=False).encode()
