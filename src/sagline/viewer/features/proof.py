"""Proof: the polygon of the forces on the platform, and these forces in the scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.robot.equilibrium import Equilibrium
from sagline.viewer.feature import Feature, View
from sagline.viewer.features.missing import MissingFeature
from sagline.viewer.page import Page
from sagline.viewer.readout import block, sentence
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import NONE, Color, cable_color, force_unit
from sagline.viewer.wording import number

WEIGHT, LOAD, MISSING = "weight", "load", "missing"
WEIGHT_COLOR: Color = NONE
LOAD_COLOR: Color = (120, 112, 104)
MISSING_COLOR: Color = (220, 56, 48)


@dataclass(frozen=True, slots=True, eq=False)
class Pull:
    """A force on the platform.

    Attributes:
        name: Number of its cable, or "weight", "load" or "missing".
        color: Of its cable, or its own.
        force: World axes [N], shape (3,).
        moment: About the center of mass, world axes [N m], shape (3,).
        at: Where it acts [m], shape (3,).
    """

    name: str
    color: Color
    force: Array
    moment: Array
    at: Array


def cable_forces(state: Equilibrium) -> Array:
    """What the cables pull the platform with, at their ends as they hang there [N], shape (m, 3)."""
    back = (state.exit_point - state.pose.transform(state.one_robot.platform_anchors))[:, :2]
    far = np.linalg.norm(back, axis=1, keepdims=True)
    level = np.divide(back, far, out=np.zeros_like(back), where=far > 0.0)
    cables = state.cables
    return np.column_stack((level * cables.horizontal_tension[:, None], -cables.vertical_force))


def pulls_of(state: Equilibrium, missing: Array | None = None) -> tuple[Pull, ...]:
    """All forces on a platform: of its cables, going around, then weight, load, and what is missing."""
    robot, pose = state.one_robot, state.pose
    center = pose.transform(robot.center_of_mass)
    ends = pose.transform(robot.platform_anchors)
    forces = cable_forces(state)
    order = np.argsort(np.arctan2(forces[:, 1], forces[:, 0]), kind="stable")
    pulls = [
        Pull(str(k), cable_color(int(k)), forces[k], np.cross(ends[k] - center, forces[k]), ends[k]) for k in order
    ]
    pulls.append(Pull(WEIGHT, WEIGHT_COLOR, np.array([0.0, 0.0, -robot.mass * robot.gravity]), np.zeros(3), center))
    lacking = np.zeros(6) if missing is None else missing
    for name, color, wrench in ((LOAD, LOAD_COLOR, state.wrench - lacking), (MISSING, MISSING_COLOR, lacking)):
        if np.linalg.norm(wrench) > 0.0:
            pulls.append(Pull(name, color, wrench[:3], wrench[3:], center))
    return tuple(pulls)


def residual(state: Equilibrium, pulls: tuple[Pull, ...]) -> tuple[float, float]:
    """What the forces do not add up to along the platform's free motions: force [N] and moment [N m]."""
    whole = np.concatenate((sum(each.force for each in pulls), sum(each.moment for each in pulls)))
    freedom = state.one_robot.freedom
    rest = freedom.T @ (freedom @ whole)
    return float(np.linalg.norm(rest[:3])), float(np.linalg.norm(rest[3:]))


def turns(state: Equilibrium) -> bool:
    """Whether the platform can turn, so that moments have to balance too."""
    return bool(np.abs(state.one_robot.freedom[:, 3:]).max() > 0.0)


WIDTH, BORDER = 340.0, 24.0  # px
HIGHEST: Final = 200.0  # px, of a view
HEAD: Final = (7.0, 2.8)  # length and half the width of an arrow's head [px]
SHORT: Final = 3.0  # px: an arrow that is shorter has no name
LETTER: Final = (7.5, 11.0)  # px: how wide and high a letter of a name is at most
BESIDE: Final = 3.0  # px, between an arrow and its name
SHARES: Final = (0.5, 0.35, 0.65, 0.2, 0.8)  # of an arrow, where its name may stand; the middle first
SIDES: Final = ((0, 2), (1, 2), (0, 1))  # axes to the right and up: from the front, from the side, from above
FLAT: Final = 1e-3  # of the largest view: one this small shows nothing
SHOWN: Final = 2  # of them, those in which most is seen


class Projection(NamedTuple):
    """The polygon from one side.

    Attributes:
        names: Of the axes that point to the right and up.
        points: Corners [N], shape (k + 1, 2): where each force begins and ends.
    """

    names: str
    points: Array


class Box(NamedTuple):
    """Where a name stands.

    Attributes:
        x: Of its middle [px].
        y: Of its middle, down [px].
        across: Half its width [px].
        up: Half its height [px].
    """

    x: float
    y: float
    across: float
    up: float

    def shared(self, other: Box) -> float:
        """The area that both cover [px^2]."""
        wide = self.across + other.across - abs(self.x - other.x)
        return max(wide, 0.0) * max(self.up + other.up - abs(self.y - other.y), 0.0)


def force_polygon_figure(state: Equilibrium, missing: Array | None = None) -> str:
    """HTML: the polygon from two sides with what does not close, and the forces and moments as numbers."""
    pulls = pulls_of(state, missing)
    corners = np.vstack((np.zeros(3), np.cumsum([each.force for each in pulls], axis=0)))
    views = [Projection("xyz"[right] + "xyz"[up], corners[:, [right, up]]) for right, up in SIDES]
    areas = [float(np.prod(np.ptp(view.points, axis=0))) for view in views]
    shown = np.sort(np.argsort(areas)[::-1][:SHOWN])
    views = [views[k] for k in shown if areas[k] > FLAT * max(areas)] or views[:1]  # a planar robot has one
    extents = np.array([np.ptp(view.points, axis=0) for view in views])
    scale = float(min((WIDTH - 2.0 * BORDER) / max(extents[:, 0].max(), 1e-12), HIGHEST / extents[:, 1].max()))
    drawn = "".join(_drawing(view, pulls, scale) for view in views)
    return block(drawn) + sentence(_told(state, pulls, missing)) + block(_table(state, pulls))


def _drawing(view: Projection, pulls: tuple[Pull, ...], scale: float) -> str:
    low, high = view.points.min(axis=0), view.points.max(axis=0)
    height = scale * float(high[1] - low[1]) + 2.0 * BORDER
    left = 0.5 * (WIDTH - scale * float(high[0] - low[0]))
    places = np.column_stack(
        (left + scale * (view.points[:, 0] - low[0]), height - BORDER - scale * (view.points[:, 1] - low[1]))
    )
    taken: list[Box] = []
    arrows = "".join(_arrow(pull, places[k], places[k + 1], taken) for k, pull in enumerate(pulls))
    right, up = view.names[0], view.names[1]
    return (
        f'<svg viewBox="0 0 {WIDTH:.0f} {height:.0f}" role="img" class="forces" '
        f'aria-label="forces on the platform head to tail, {right} to the right, {up} up">{arrows}'
        f'<text x="4" y="12" class="quiet">{up}</text><text x="26" y="{26:.0f}" class="quiet">{right}</text>'
        '<path d="M8 26V16M8 26H22" class="axes"/></svg>'
    )


def _arrow(pull: Pull, start: Array, end: Array, taken: list[Box]) -> str:
    """An arrow with its name beside it, where none stands yet of those taken; what is missing is dashed."""
    way = end - start
    length = float(np.hypot(*way))
    if length < 0.5:
        return ""
    along = way / length
    aside = np.array([-along[1], along[0]])
    head = min(HEAD[0], 0.6 * length)
    neck = end - head * along
    wings = [neck + sign * HEAD[1] * head / HEAD[0] * aside for sign in (1.0, -1.0)]
    kind = ' class="gap"' if pull.name == MISSING else ""
    name = ""
    if length >= SHORT:
        box = _beside(pull.name, start, way, aside, taken)
        taken.append(box)
        name = f'<text x="{box.x:.1f}" y="{box.y + 4.0:.1f}" text-anchor="middle">{pull.name}</text>'
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in (end, *wings))
    return (
        f'<g style="color:{_css(pull.color)}"><line x1="{start[0]:.1f}" y1="{start[1]:.1f}" '
        f'x2="{neck[0]:.1f}" y2="{neck[1]:.1f}"{kind}/><polygon points="{corners}"/>{name}</g>'
    )


def _beside(name: str, start: Array, way: Array, aside: Array, taken: list[Box]) -> Box:
    """Where the name of an arrow stands: of the places beside it the first that is free, or covers others least."""
    across, up = 0.5 * LETTER[0] * len(name), 0.5 * LETTER[1]
    (x, y), (along, down) = start.tolist(), way.tolist()
    right, below = ((BESIDE + abs(aside[0]) * across + abs(aside[1]) * up) * aside).tolist()
    found = []
    for share in SHARES:
        for side in (1.0, -1.0):
            place = min(max(x + share * along + side * right, across), WIDTH - across)
            found.append(Box(place, y + share * down + side * below, across, up))
            if not any(map(found[-1].shared, taken)):
                return found[-1]
    return min(found, key=lambda box: sum(map(box.shared, taken)))


def _told(state: Equilibrium, pulls: tuple[Pull, ...], missing: Array | None) -> str:
    """What does not close."""
    force, moment = residual(state, pulls)
    left = n(force, ".2g", "N")
    if turns(state):
        left += f" and {n(moment, '.2g', 'N m')} about the center of mass"
    if missing is None:
        return f"Cables as they pull at the platform, weight and load close up to {left}."
    gap = n(float(np.linalg.norm(missing[:3])), ".4g", "N")
    if np.linalg.norm(missing[3:]) > 0.0:
        gap += f", with a moment of {n(float(np.linalg.norm(missing[3:])), '.4g', 'N m')}"
    return f"The gap is the missing force, {gap}; with it and the cables at their limits the forces close up to {left}."


def _table(state: Equilibrium, pulls: tuple[Pull, ...]) -> str:
    unit, turning = force_unit(state.one_robot), turns(state)
    decimals = _decimals(max(float(np.abs(each.force).max()) for each in pulls) / unit.newtons)
    forces = "".join(f"<th>F<sub>{axis}</sub></th>" for axis in "xyz")
    moments = "".join(f"<th>M<sub>{axis}</sub></th>" for axis in "xyz") if turning else ""
    head = f"<tr><th>[{unit.name}{f', {unit.name} m' if turning else ''}]</th>{forces}{moments}</tr>"
    numbered = sorted(pulls, key=lambda each: (not each.name.isdigit(), int(each.name) if each.name.isdigit() else 0))
    rows = "".join(
        f'<tr><td><span class="swatch" style="background:{_css(each.color)}"></span> {each.name}</td>'
        + _cells(each.force / unit.newtons, each.moment / unit.newtons, decimals, turning=turning)
        + "</tr>"
        for each in numbered
    )
    force = np.sum([each.force for each in pulls], axis=0) / unit.newtons
    moment = np.sum([each.moment for each in pulls], axis=0) / unit.newtons
    whole = _cells(force, moment, decimals, turning=turning)
    return f'<table class="forces">{head}{rows}<tr class="sum"><td>sum</td>{whole}</tr></table>'


def _decimals(largest: float) -> int:
    """How many decimals show a thousandth of a force of that size, as far as the table is wide enough."""
    return 1 if largest >= 99.95 else 2 if largest >= 9.995 else 3


def _cells(force: Array, moment: Array, decimals: int, *, turning: bool) -> str:
    parts = np.concatenate((force, moment)) if turning else force
    cells = [number(part, f".{decimals}f") for part in parts]
    return "".join(f"<td>{cell}</td>" for cell in cells)


def _css(color: Color) -> str:
    return "#{:02x}{:02x}{:02x}".format(*color)


LONG: Final = 0.22  # of the robot's size: the longest arrow in the scene
ARROW_HEAD, HEAD_RADIUS, SHAFT_RADIUS = 0.03, 0.011, 0.0045
NOT_AT_REST: Final = "In motion, and in a log, forces do not add up to nothing: the proof is one of a pose at rest."
UNKNOWN: Final = "There are no tensions here, and no force is known that would do: nothing to add up."


class ProofFeature(Feature):
    """Follows what is shown; all of it belongs to the thread that serves."""

    def __init__(self, page: Page) -> None:
        """Build the tab."""
        self._page, self._scene, self._size = page, page.server.scene, page.size
        self._arrows: Any = None
        with page.panel.readings.add_tab("Proof"):
            self._wanted: Any = page.server.gui.add_checkbox(
                "Forces in the scene", False, hint="As arrows at the platform, the longest always of the same length."
            )
            self._told = page.server.gui.add_html("")
        self._wanted.on_update(lambda _: page.refresh())

    def follow(self, view: View) -> None:
        """Add up the forces of what is shown."""
        state, lacking = self._balance(view)
        if state is None:
            self._told.content = sentence(NOT_AT_REST if not isinstance(view.snapshot, Snapshot) else UNKNOWN)
        else:
            self._told.content = force_polygon_figure(state, lacking)
        self._draw(state if self._wanted.value else None, lacking)

    def _balance(self, view: View) -> tuple[Equilibrium | None, Array | None]:
        """What is in balance, and the wrench that nobody gives."""
        snapshot = view.snapshot
        if not isinstance(snapshot, Snapshot):
            return None, None
        if snapshot.plan is not None and snapshot.feasible:
            return snapshot.plan.state, None
        missing = self._page.feature(MissingFeature).missing
        return (None, None) if missing is None else (missing.state, missing.wrench)

    def _draw(self, state: Equilibrium | None, lacking: Array | None) -> None:
        """Arrows from where the forces act; those toward the platform's middle, its weight too, from there."""
        if state is None:
            if self._arrows is not None:
                self._arrows.visible = False
            return
        pulls = pulls_of(state, lacking)
        longest = max(float(np.linalg.norm(each.force)) for each in pulls)
        scale = LONG * self._size / longest
        ends = np.array([[each.at, each.at + scale * each.force] for each in pulls], dtype=np.float32)
        colors = np.array([each.color for each in pulls], dtype=np.uint8)
        if self._arrows is None or len(self._arrows.points) != len(ends):
            if self._arrows is not None:
                self._arrows.remove()
            self._arrows = self._scene.add_arrows(
                "/forces", ends, colors, shaft_radius=SHAFT_RADIUS * self._size, head_radius=HEAD_RADIUS * self._size,
                head_length=ARROW_HEAD * self._size,
            )  # fmt: skip
        self._arrows.points, self._arrows.colors, self._arrows.visible = ends, colors, True
