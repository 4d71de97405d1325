"""Messages of a log checked with the schemas in the log."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader

import sagline as sl
from sagline.files.mcap_writer import Recorder

ROBOT = sl.load_robot("article-prototype")
HOME = sl.Pose([0.0, 0.0, 1.5], np.eye(3))
KEYS = {"title", "description", "type", "properties", "items", "required"}
PLAIN: dict[str, tuple[type, ...]] = {"string": (str,), "integer": (int,), "number": (int, float)}


def errors(schema: dict[str, Any], value: Any, place: str = "") -> list[str]:
    """Places of a value that contradict a schema; only constructs that Foxglove reads are valid."""
    assert schema.keys() <= KEYS
    if schema["type"] == "object":
        if not isinstance(value, dict):
            return [place]
        known = schema["properties"]
        wrong = [f"{place}/{name}" for name in schema.get("required", ()) if name not in value]
        wrong += [f"{place}/{name}" for name in value if name not in known]
        return wrong + [
            each for name in value if name in known for each in errors(known[name], value[name], f"{place}/{name}")
        ]
    if schema["type"] == "array":
        if not isinstance(value, list):
            return [place]
        return [each for i, item in enumerate(value) for each in errors(schema["items"], item, f"{place}/{i}")]
    return [] if isinstance(value, PLAIN[schema["type"]]) and not isinstance(value, bool) else [place]


def no_constant(text: str) -> float:
    raise ValueError(f"{text} is not JSON")


def test_a_schema_finds_errors_of_a_message() -> None:
    schema = {
        "type": "object",
        "properties": {"a": {"type": "array", "items": {"type": "number"}}, "b": {"type": "string"}},
        "required": ["b"],
    }
    assert errors(schema, {"a": [1, 2.5], "b": ""}) == []
    assert errors(schema, {"a": [1, None, True], "c": 1}) == ["/b", "/c", "/a/1", "/a/2"]


def test_messages_of_a_run_with_a_failing_cell_are_valid(tmp_path: Path) -> None:
    machine = sl.twin.Machine(ROBOT, start=HOME, seed=1, faults="cell 5 fails at 1.5 s")
    with Recorder(tmp_path / "run.mcap", ROBOT) as record:
        control = sl.control.Controller(ROBOT, machine.link(), seed=2, record=record)
        control.connect()
        control.home(HOME)
        control.go_to(sl.Pose([0.2, -0.4, 1.4], np.eye(3)))
        for _ in range(20):
            control.cycle()
        reading = machine.reading
        record.truth(machine.time, reading.position, reading.quaternion)
    found: dict[str, list[dict[str, Any]]] = {}
    with (tmp_path / "run.mcap").open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if schema is None or schema.encoding != "jsonschema":
                continue
            assert schema.data
            value = json.loads(message.data, parse_constant=no_constant)
            assert errors(json.loads(schema.data), value) == [], channel.topic
            found.setdefault(channel.topic, []).append(value)
    assert set(found) == {"/cycle", "/event", "/truth"}
    assert [each["time"] for each in found["/truth"]] == [machine.time]
    lost = [cycle for cycle in found["/cycle"] if "tension" not in cycle and "partial" in cycle]
    assert len(lost) == sum(cycle["time"] > 1.5 for cycle in found["/cycle"]) > 30
    for cycle in lost:
        known = {each["index"]: each["value"] for each in cycle["partial"] if each["name"] == "tension"}
        assert sorted(known) == [0, 1, 2, 3, 4, 6, 7]
        assert min(known.values()) > 50.0
    assert all(np.isfinite(cycle["tension"]).all() for cycle in found["/cycle"] if cycle not in lost)
