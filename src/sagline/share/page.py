"""A robot or a run as one HTML page that contains its styles, scripts and numbers."""

from __future__ import annotations

import json
from collections.abc import Sequence
from html import escape
from importlib.metadata import version
from importlib.resources import files
from typing import Any, Final

import numpy as np

from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.kinematics.inverse import inverse
from sagline.robot.pose import Pose
from sagline.robot.reach import bounds, home_pose
from sagline.robot.robot import Robot
from sagline.share.course import SharedMotion
from sagline.share.machine import colors, drawing_data, json_numbers, model_data, robot_drawing, solids_data
from sagline.share.packing import PackedColumn, encode_columns, module_text, page_script
from sagline.viewer.shapes import round_below, size_of
from sagline.viewer.tension_scale import number_text

SCRIPTS: Final = (  # in the order of their dependencies
    "robot.js", "states.js", "theme.js",
    "renderer.js", "camera.js", "scene.js", "panel.js",
    "pointers.js", "player.js", "share.js",
)  # fmt: skip
MADE: Final = '<meta name="generator" content="sagline'  # mark of the pages of sagline
POSITION, TURN, LENGTH, TENSION, TIME = 1e-5, 1e-6, 1e-5, 1e-4, 1e-6  # resolutions [m, -, m, relative, s]
WOUND: Final = 0.002  # largest change of a length with the slider, as a share of the robot's size
SPEEDS: Final = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
RING: Final = '<div class="ring" data-part="ring" aria-hidden="true"></div>'
HOME: Final = '<button type="button" class="home" data-part="home">Home</button>'
AROUND: Final = "Drag, or press the arrow keys, to look around; pinch, scroll, or press + and − to zoom."


def robot_page(robot: Robot) -> str:
    """Page of a robot whose platform can be dragged. Scripts of the page compute the tensions."""
    at = home_pose(robot)
    plan = inverse(robot, at)
    facts = {**_facts(robot, model_data(robot)), "home": {"position": json_numbers(at.position)}}
    return _filled(
        title=robot.name,
        about=_about(robot),
        plays="shows how the cables tighten and sag when the platform is dragged",
        described=f"{robot.name}: its platform on cables. {AROUND}",
        hint="Drag the platform; drag the background to look around.",
        controlled="Position of the platform",
        controls=_sliders(robot),
        over=RING + HOME,
        quantity="along the chord",
        still=robot_drawing(robot, at, plan.chord_tension),
        table=_table(robot, plan.chord_tension, plan.unstrained_length),
        notes=("Tensions of least norm within the limits, elastic catenaries, platform at rest.", *_guides(robot)),
        facts=facts,
        states="",
    )


def course_page(course: SharedMotion, title: str) -> str:
    """Page for the playback of a run."""
    robot, kept = course.robot, course.thinned()
    start = home_pose(robot)
    if np.isfinite(kept.position[0]).all():
        start = Pose.from_quaternion(kept.position[0], kept.quaternion[0])
    header, text = encode_columns(
        [
            PackedColumn("time", kept.time, TIME),
            PackedColumn("position", kept.position, POSITION),
            PackedColumn("quaternion", kept.quaternion, TURN),
            PackedColumn("tension", kept.tension, TENSION, "relative"),
            PackedColumn("chord_tension", kept.chord_tension, TENSION, "relative"),
            PackedColumn("length", kept.length, LENGTH),
            PackedColumn("verdict", kept.verdict.astype(np.float64), 1.0),
        ]
    )
    facts = {
        **_facts(robot, drawing_data(robot)),
        "states": header,
        "verdicts": [{"good": good, "words": words} for good, words in kept.verdicts],
    }
    about = f"{robot.name}, {kept.kind} of {kept.time[-1]:.4g} s"
    return _filled(
        title=title,
        about=about,
        plays="plays",
        described=f"{about}: the platform on its cables. {AROUND}",
        hint="Drag to look around.",
        controlled="Clock",
        controls=_clock(),
        over=HOME,
        quantity=kept.quantity,
        still=robot_drawing(robot, start, kept.chord_tension[0]),
        table=_table(robot, kept.tension[0], kept.length[0]),
        notes=(*kept.notes, _precision()),
        facts=facts,
        states=f'<script type="text/plain" data-part="states">{text}</script>',
    )


def _filled(facts: dict[str, Any], notes: Sequence[str], **parts: str) -> str:
    own = files("sagline.share").joinpath("page")
    scale = facts["colors"]
    low, high = (f"{scale[end] / scale['newtons']:,.4g}" for end in ("low", "high"))
    markup = ("over", "still", "table", "controls", "states")
    words = {name: text if name in markup else escape(text) for name, text in parts.items()}
    words |= {
        "version": version("sagline"),
        "style": own.joinpath("share.css").read_text(encoding="utf-8"),
        "script": "\n".join((page_script(), *(own.joinpath(name).read_text(encoding="utf-8") for name in SCRIPTS))),
        "kernels": module_text(),
        "unit": scale["unit"],
        "legend": f"Colors of the cables: from {low} to {high} {scale['unit']}",
        "notes": "".join(f'<p class="notes">{escape(note)}</p>' for note in notes),
        "facts": json.dumps(facts, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"),
    }
    text = own.joinpath("share.html").read_text(encoding="utf-8")
    pieces = text.split("{")
    return pieces[0] + "".join(words[name] + rest for name, _, rest in (piece.partition("}") for piece in pieces[1:]))


def _facts(robot: Robot, machine: dict[str, Any]) -> dict[str, Any]:
    return {"machine": machine, "picture": solids_data(robot), "colors": colors(robot)}


def _about(robot: Robot) -> str:
    mass = n(robot.mass, ".4g", "kg")
    return f"{robot.cable_count} cables, {robot.degrees_of_freedom} degrees of freedom, a platform of {mass}"


def _sliders(robot: Robot) -> str:
    """Sliders of the free translations, and of the rotation about the vertical."""
    (low, high), at, freedom = bounds(robot), home_pose(robot).position, robot.freedom
    free = np.linalg.norm(freedom.T @ freedom, axis=1) > 1.0 - 1e-9  # only free motions along a single axis
    found = [
        _slider(f"<i>{name}</i>", axis, min(low[axis], at[axis]), max(high[axis], at[axis]), 1e-3)
        for axis, name in enumerate("xyz")
        if free[axis]
    ]
    if free[5]:
        found.append(_slider("turn", 3, -180.0, 180.0, 1.0))
    return "".join(found) + _winch(robot)


def _guides(robot: Robot) -> tuple[str, ...]:
    """Note for a robot with guides, because the page draws no catenaries between guides."""
    given = robot.winches is not None and robot.winches.guides is not None
    return ("Cables between guides count as straight.",) * given


def _winch(robot: Robot) -> str:
    """HTML of the choice of a cable, and of a slider for the change of its length [mm]."""
    names = "".join(f'<option value="{i}">{i}</option>' for i in range(robot.cable_count))
    most = 1e3 * round_below(WOUND * size_of(robot))
    return (
        f'<label>cable <select data-part="cable" aria-label="Cable to wind">{names}</select>'
        f'<input type="range" data-part="wind" aria-label="Change of its length" min="{-most:g}" max="{most:g}" '
        f'step="{most / 50:g}" value="0"><span aria-hidden="true"></span></label>'
    )


def _slider(name: str, axis: int, low: float, high: float, step: float) -> str:
    return (
        f'<label>{name} <input type="range" data-axis="{axis}" min="{low:.6g}" max="{high:.6g}" step="{step:g}">'
        f'<span aria-hidden="true"></span></label>'
    )


def _clock() -> str:
    speeds = "".join(
        f'<option value="{speed:g}"{" selected" * (speed == 1.0)}>{speed:g} ×</option>' for speed in SPEEDS
    )
    return (
        '<button type="button" class="play" data-part="play" aria-label="Play"></button>'
        '<span class="time"><input type="range" data-part="time" min="0" value="0" aria-label="Time">'
        '<span data-part="spans" role="img" aria-label=""></span></span>'
        '<output data-part="clock" aria-hidden="true"></output>'
        f'<select data-part="speed" aria-label="Speed">{speeds}</select>'
    )


def _table(robot: Robot, tension: Array, length: Array) -> str:
    """Table of the cables at the start, for browsers without JavaScript."""
    rows = "".join(
        f"<tr><td>{i}</td><td>{number_text(tension[i], ',.1f')}</td><td>{number_text(length[i], '.4f')}</td></tr>"
        for i in range(robot.cable_count)
    )
    head = "".join(f'<th scope="col">{name}</th>' for name in ("cable", "tension [N]", "length [m]"))
    return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def _precision() -> str:
    """Largest rounding errors of the values in a page, in words."""
    return (
        f"Rounded to {0.5e6 * POSITION:g} µm of positions and lengths, {0.5e6 * TURN:g} µrad of rotations, "
        f"{50.0 * TENSION:g} % of tensions. The catenaries are computed in this page."
    )
