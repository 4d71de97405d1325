"""Contents of an MCAP log: quantities of a cycle, topics with their schemas, attachments, and scenes."""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib.metadata import version
from itertools import combinations
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from sagline.control.execution import Execution
from sagline.control.states import State
from sagline.core.arrays import Array
from sagline.files.variables import NONE, SOMEWHERE, Quantity
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
    from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
    from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

ROWS: Final = "time"
GROUP, CABLE, AXIS, TURN = ("group",), ("cable",), ("axis",), ("quaternion_part",)
WORLD, PLATFORM = "world", "platform"
FINE, COARSE = 2.0**20, 2.0**10  # number of steps per meter of drawn coordinates, so that most of their bytes are zero
POINTS: Final = 7  # number of points per cable
_THICKNESS: Final = 3.0  # line width [px]
_STEEL, _BLUE, _CABLE = (0.47, 0.5, 0.54), (0.23, 0.53, 0.79), (0.55, 0.36, 0.17)  # color: red, green, blue, 0 to 1


def _real(name: str, parts: tuple[str, ...], unit: str, long_name: str, source: str = "") -> Quantity:
    return Quantity(name, parts, unit, long_name, source, SOMEWHERE, infinite=True)


def _integer(name: str, parts: tuple[str, ...], long_name: str, source: str = "") -> Quantity:
    return Quantity(name, parts, "", long_name, source, values=int)


TIME: Final = _real("time", (), "s", "time on the clock of the link")
CYCLES: Final = (
    Quantity("answered", (), "", "true if there was a sample", values=bool),
    Quantity("state", (), "", "state of the controller at the end of the cycle", codes=State),
    _real("late", (), "s", "delay of the start of the cycle"),
    _real("clock", (), "s", "time on the plan, from the start of the plan; none without a plan"),
    _real("position", AXIS, "m", "position of the platform origin, estimated from the encoders"),
    _real("quaternion", TURN, "1", "rotation from platform to world, estimated, scalar last"),
    Quantity("estimate", (), "", f"code of the estimate; {NONE}: none", values=np.int8),
    Quantity("mode", (), "", f"code of the command's mode; {NONE}: no command", values=np.int8),
    _real("set_length", CABLE, "m", "set point of the unstrained length, with the zero of homing"),
    _real("set_rate", CABLE, "m/s", "set point of the rate of the length"),
    _real("set_tension", CABLE, "N", "set point of the tension at the drum"),
    _real("planned_tension", CABLE, "N", "planned tension at the frame end at the time of the sample"),
    _real("correction", CABLE, "m", "correction of the set length by the tension loop"),
    _real("age", GROUP, "s", "time since the arrival of the newest valid block", "samples."),
    _integer("counter", GROUP, "counter of the blocks", "samples."),
    _real("plc_time", GROUP, "s", "time of the PLC's block, on the clock of the PLC", "samples."),
    _integer("owner", GROUP, "id of the controller that owns the group; 0: none", "samples."),
    _integer("echo", GROUP, "counter of the last command that the PLC accepted", "samples."),
    _integer("group_status", GROUP, "bits of the PLC's status", "samples.status"),
    _integer("group_fault", GROUP, "code of the reason why the PLC has stopped its winches; 0: none", "samples.fault"),
    _integer("discarded", GROUP, "number of invalid blocks so far", "samples."),
    _real("length", CABLE, "m", "unstrained length off the drum, from the encoder, before homing", "samples."),
    _real("rate", CABLE, "m/s", "rate of the length", "samples."),
    _real("torque", CABLE, "N m", "torque at the motor's shaft, positive if it pays out cable", "samples."),
    _real("tension", CABLE, "N", "tension at the frame end, from the load cell", "samples."),
    _real("filtered", CABLE, "N", "tension at the frame end, after the filter of the PLC", "samples."),
    _integer("counts", CABLE, "counts of the encoder", "samples."),
    _integer("winch_state", CABLE, "code of the winch's state", "samples.state"),
    _integer("winch_fault", CABLE, "fault code of the drive; 0: none", "samples."),
)
EVERY: Final = (TIME, *CYCLES)
# Decimals of the quantities that are recorded while the machine runs. This rounding is finer than the resolution of the
# sensors: an encoder step is 72 nm, and the noise of a load cell is 1 N. Counts are not rounded. With all digits of the
# noise, a log of 14 minutes would be twice as large.
DECIMALS: Final = {
    "time": 6, "late": 6, "clock": 6, "age": 5, "plc_time": 5, "position": 7, "quaternion": 8, "length": 7,
    "set_length": 8, "correction": 8, "rate": 5, "set_rate": 7, "torque": 3, "tension": 2, "filtered": 2,
    "set_tension": 3, "planned_tension": 3,
}  # fmt: skip
EVENTS: Final = {  # variables of events
    "time": "time on the clock of the link [s]",
    "cycle": "cycle of the controller, from 0",
    "kind": "state, fault or note",
    "name": "name of the new state, or of the fault",
    "state": "state of the controller after the event",
    "text": "message to the operator",
}


def columns_of(execution: Execution) -> dict[str, NDArray[Any]]:
    """Columns of N cycles, by the name of the quantity. The first axis of each column has the length N."""
    return {quantity.name: quantity.of(execution) for quantity in EVERY}


NANO: Final = 1e9  # ticks of the log's clock per second [1/s]
FORMAT: Final = 1  # incremented with every change that an older version of sagline could misread
SOURCE: Final = f"sagline {version('sagline')}"
CYCLE, RECORD, EVENT, TF, SCENE, TRUTH = "/cycle", "/record", "/event", "/tf", "/scene", "/truth"
HEAD: Final = "sagline.json"  # attachment: format, period, robot
PLAN: Final = "plan-{}.sagline"  # attachment: plan as a packed data set
END: Final = "plan-{}-end.json"  # attachment: status and reason
PACKED: Final = "application/x-sagline-columns"
JSON: Final = "application/json"
SHARE_TF, SHARE_SCENE = 10, 100  # number of cycles per message
PER_METER: Final = 1e3  # [mm/m]


def _number(description: str) -> dict[str, Any]:
    return {"type": "number", "description": description}


def _list(description: str) -> dict[str, Any]:
    return {"type": "array", "items": {"type": "number"}, "description": description}


# Number of decimals and JSON schema of the quantities of the topic `/cycle`. They are rounded for human readers. The
# topic `/record` contains all digits.
CYCLE_FIELDS: Final = {
    "time": (2, _number("time on the clock of the link [s]")),
    "late": (4, _number("delay of the start of the cycle [s]")),
    "clock": (2, _number("time on the plan, from the start of the plan [s]")),
    "position": (5, _list("position of the platform's origin, estimated from the encoders [m]")),
    "tension": (1, _list("tensions at the frame ends, from the load cells [N]")),
    "planned_tension": (1, _list("planned tensions at the frame ends [N]")),
    "length_error": (2, _list("set length minus encoder length [mm]")),
    "correction": (2, _list("corrections of the lengths by the tension loop [mm]")),
}


def _schema(title: str, **properties: Any) -> bytes:
    return json.dumps({"title": title, "type": "object", "properties": properties}).encode()


_TEXT: Final = {"type": "string"}
# Foxglove cannot read a schema that allows two types for a value. A list with missing numbers is therefore written as a
# list of objects.
PARTIAL: Final = "partial"
_PARTIAL: Final = {
    "type": "array",
    "description": "known values of lists that are left out, because one of their values is not a number",
    "items": {
        "type": "object",
        "properties": {"name": _TEXT, "index": {"type": "integer"}, "value": {"type": "number"}},
        "required": ["name", "index", "value"],
    },
}
SCHEMAS: Final = {
    CYCLE: _schema(
        "sagline.Cycle", state=_TEXT, **{name: shown for name, (_, shown) in CYCLE_FIELDS.items()}, partial=_PARTIAL
    ),
    EVENT: _schema(
        "sagline.Event",
        time=_number("[s]"),
        cycle={"type": "integer"},
        **dict.fromkeys(("kind", "name", "state", "text"), _TEXT),
    ),
    TRUTH: _schema(
        "sagline.Truth",
        time=_number("time on the clock of the twin [s]"),
        position=_list("position of the platform's origin [m]"),
        quaternion=_list("rotation from platform to world, scalar last [1]"),
    ),
}


def head_of(robot: str, period: float) -> bytes:
    """Attachment at the start of a log: cycle period [s], and the robot as the text of its file."""
    return json.dumps({"sagline_log_format": FORMAT, "source": SOURCE, "period": period, "robot": robot}).encode()


def cycle_texts(columns: dict[str, NDArray[Any]]) -> Iterator[bytes]:
    """Messages of N cycles for other programs. Their numbers are rounded."""
    away = PER_METER * (columns["set_length"] - columns["length"] - columns["zero"])
    there = {**columns, "length_error": away, "correction": PER_METER * columns["correction"]}
    kept = {"state": [State(code).name for code in columns["state"].tolist()]}
    kept |= {name: _json_values(np.round(there[name], digits)) for name, (digits, _) in CYCLE_FIELDS.items()}
    for row in zip(*kept.values(), strict=True):
        known = {name: value for name, value in zip(kept, row, strict=True) if value is not None}
        for name in [name for name, value in known.items() if isinstance(value, list) and None in value]:
            pairs = enumerate(known.pop(name))
            part = [{"name": name, "index": index, "value": value} for index, value in pairs if value is not None]
            known[PARTIAL] = known.get(PARTIAL, []) + part
        yield message_of(known)


def _json_values(values: NDArray[Any]) -> list[Any]:
    """Convert values for JSON. A number that is not finite becomes None, and so does a row without finite numbers."""
    known = np.isfinite(values)
    if known.all():
        return list(values.tolist())
    rows: list[Any] = np.where(known, values.astype(object), None).tolist()  # type: ignore[call-overload]
    return rows if values.ndim == 1 else [row if there else None for row, there in zip(rows, known.any(1), strict=True)]


def message_of(said: dict[str, Any]) -> bytes:
    """Message in JSON, with all digits."""
    return json.dumps(said, separators=(",", ":"), ensure_ascii=False).encode()


def transform(stamp: int, position: Array, quaternion: Array) -> FrameTransform:
    """Foxglove message with the pose of the platform at `stamp` [ns]; `position` [m], `quaternion` scalar last."""
    from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform

    found = FrameTransform(parent_frame_id=WORLD, child_frame_id=PLATFORM)
    found.timestamp.FromNanoseconds(stamp)
    for target, values in ((found.translation, position), (found.rotation, quaternion)):
        for name, value in zip("xyzw", np.rint(values * FINE) / FINE, strict=False):
            setattr(target, name, value)
    return found


class Scene:
    """Scene of a robot, drawn as lines. The constant parts are created once."""

    def __init__(self, robot: Robot) -> None:
        """Draw frame and platform."""
        self._robot = robot
        self._frame = _corners(robot.frame_anchors)
        self._body = _corners(robot.platform_anchors)

    def at(self, stamp: int, position: Array, quaternion: Array, tension: Array) -> SceneUpdate:
        """Scene at `stamp` [ns]; `position` [m]; `quaternion` scalar last; `tension` at the frame ends [N]."""
        from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

        scene = SceneUpdate()
        _lines(scene.entities.add(), stamp, "frame", WORLD, _STEEL, self._frame)
        _lines(scene.entities.add(), stamp, "platform", PLATFORM, _BLUE, self._body)
        ends = Pose.from_quaternion(position, quaternion).transform(self._robot.platform_anchors)
        _lines(scene.entities.add(), stamp, "cables", WORLD, _CABLE, self._cables(ends, tension))
        return scene

    def _cables(self, ends: Array, tension: Array) -> Array:
        """Points along the cables (m, POINTS, 3), on parabolas that look like the exact cables."""
        robot, share = self._robot, np.linspace(0.0, 1.0, POINTS)[:, None]
        start = robot.frame_anchors[:, None]
        run = ends[:, None] - start
        points = np.asarray(start + share * run)
        chord = np.linalg.norm(run[:, 0], axis=1)
        span = np.hypot(run[:, 0, 0], run[:, 0, 1])
        weight = robot.cables.linear_density * robot.gravity  # weight per length [N/m]
        deep = 0.5 * weight * span * chord / np.maximum(tension, weight * chord)  # [m], four times the sag
        points[:, :, 2] -= np.where(np.isfinite(deep), deep, 0.0)[:, None] * (share * (1.0 - share))[:, 0]
        return points


def _lines(entity: SceneEntity, stamp: int, name: str, frame: str, color: tuple[float, ...], courses: Array) -> None:
    """Draw polylines (k, P, 3)."""
    entity.id, entity.frame_id = name, frame
    entity.timestamp.FromNanoseconds(stamp)
    for course in np.rint(courses * COARSE) / COARSE:
        line: Any = entity.lines.add()
        line.thickness, line.scale_invariant = _THICKNESS, True
        line.color.r, line.color.g, line.color.b = color
        line.color.a = line.pose.orientation.w = 1.0
        for x, y, z in course.tolist():
            line.points.add(x=x, y=y, z=z)


def _corners(points: Array) -> Array:
    """Lines (e, 2, 3) between pairs of points. A pair is skipped if a third point is closer to both points."""
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    near = [
        (i, j)
        for i, j in combinations(range(len(points)), 2)
        if (np.maximum(distance[i], distance[j]) >= distance[i, j] * (1.0 - 1e-9)).all()
    ]
    return points[np.array(near, dtype=np.intp).reshape(-1, 2)]
