"""Force balance of the shown pose: polygon of the forces on the platform, and arrows in the scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.kinematics.slanted import with_eyelets
from sagline.robot.equilibrium import Equilibrium
from sagline.statics.slopes import platform_end_forces
from sagline.viewer.feature import Feature, View
from sagline.viewer.page import Page
from sagline.viewer.readout import css_color, html_block, sentence, swatch
from sagline.viewer.robot_scene import INFEASIBLE, Nodes
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import NONE, Color, ForceUnit, cable_color, number_text

WEIGHT, LOAD, MISSING = "weight", "load", "missing"
WEIGHT_COLOR: Color = NONE
LOAD_COLOR: Color = (120, 112, 104)


@dataclass(frozen=True, slots=True, eq=False)
class _PlatformForce:
    """A force on the platform."""

    name: str  # number of its cable, or "weight", "load" or "missing"
    color: Color  # color of its cable, or a color of its own
    wrench: Array  # force, and moment about the center of mass, world axes [N, N m], shape (6,)
    at: Array  # point at which it acts [m], shape (3,)


def forces_on_platform(state: Equilibrium, missing: Array | None = None) -> tuple[_PlatformForce, ...]:
    """All forces on a platform: those of the cables in order of azimuth, then weight, load and missing force."""
    load, state = state.wrench, with_eyelets(state)
    robot, pose = state.one_robot, state.pose
    center = pose.transform(robot.center_of_mass)
    ends = pose.transform(robot.platform_anchors)
    pulls = -platform_end_forces(state)  # forces of the cables on the platform
    order = np.argsort(np.arctan2(pulls[:, 1], pulls[:, 0]), kind="stable").tolist()
    wrenches = np.hstack((pulls, np.cross(ends - center, pulls)))
    forces = [_PlatformForce(str(k), cable_color(k), wrenches[k], ends[k]) for k in order]
    # the mass of a platform with winches includes the cable off their drums
    weight = np.array([0.0, 0.0, -robot.mass * robot.gravity, 0.0, 0.0, 0.0]) + (state.wrench - load)
    forces.append(_PlatformForce(WEIGHT, WEIGHT_COLOR, weight, center))
    lacking = np.zeros(6) if missing is None else missing
    for name, color, wrench in ((LOAD, LOAD_COLOR, load - lacking), (MISSING, INFEASIBLE, lacking)):
        if np.linalg.norm(wrench) > 0.0:
            forces.append(_PlatformForce(name, color, wrench, center))
    return tuple(forces)


def residual(state: Equilibrium, forces: tuple[_PlatformForce, ...]) -> tuple[float, float]:
    """Residual of the force balance along the free motions: magnitudes of force [N] and moment [N m]."""
    freedom = state.one_robot.freedom
    rest = freedom.T @ (freedom @ sum(each.wrench for each in forces))
    return float(np.linalg.norm(rest[:3])), float(np.linalg.norm(rest[3:]))


def _can_rotate(state: Equilibrium) -> bool:
    """True if the platform can rotate, so that the balance includes moments."""
    return bool(np.abs(state.one_robot.freedom[:, 3:]).max() > 0.0)


WIDTH, BORDER = 340.0, 24.0  # width of the figure, and its margin [px]
HIGHEST: Final = 200.0  # largest height of a view [px]
HEAD: Final = (7.0, 2.8)  # length and half width of an arrow's head [px]
SHORT: Final = 3.0  # shortest arrow with a name [px]
LETTER: Final = (7.5, 11.0)  # largest width and height of a letter [px]
BESIDE: Final = 3.0  # distance between an arrow and its name [px]
SHARES: Final = (0.5, 0.35, 0.65, 0.2, 0.8)  # positions of a name along its arrow, in order of preference
SIDES: Final = ((0, 2), (1, 2), (0, 1))  # axes to the right and up, for front, side and top view
FLAT: Final = 1e-3  # smallest shown projection, relative to the largest one
SHOWN: Final = 2  # number of projections; those with the largest areas are shown


Label = tuple[float, float, float, float]  # center of a name, to the right and down, and half its width and height [px]


def _overlap(one: Label, other: Label) -> float:
    """Area of the intersection of two labels [px^2]."""
    wide = one[2] + other[2] - abs(one[0] - other[0])
    return max(wide, 0.0) * max(one[3] + other[3] - abs(one[1] - other[1]), 0.0)


def force_polygon_figure(state: Equilibrium, missing: Array | None = None) -> str:
    """HTML of the force polygon in two projections, its residual, and the forces and moments as numbers."""
    forces = forces_on_platform(state, missing)
    corners = np.vstack((np.zeros(3), np.cumsum([each.wrench[:3] for each in forces], axis=0)))
    views = [("xyz"[right] + "xyz"[up], corners[:, [right, up]]) for right, up in SIDES]
    areas = [float(np.prod(np.ptp(points, axis=0))) for _, points in views]
    shown = np.sort(np.argsort(areas)[::-1][:SHOWN])
    views = [views[k] for k in shown if areas[k] > FLAT * max(areas)] or views[:1]  # a planar robot has one projection
    extents = np.array([np.ptp(points, axis=0) for _, points in views])
    scale = float(min((WIDTH - 2.0 * BORDER) / max(extents[:, 0].max(), 1e-12), HIGHEST / extents[:, 1].max()))
    drawn = "".join(_projection(*view, forces, scale) for view in views)
    return html_block(drawn) + sentence(_residual_text(state, forces, missing)) + html_block(_table(state, forces))


def _projection(axes: str, points: Array, forces: tuple[_PlatformForce, ...], scale: float) -> str:
    """SVG of a force polygon on two `axes`; its k sides are `forces` between the corners `points` (k + 1, 2) [N]."""
    low, high = points.min(axis=0), points.max(axis=0)
    height = scale * float(high[1] - low[1]) + 2.0 * BORDER
    left = 0.5 * (WIDTH - scale * float(high[0] - low[0]))
    places = np.array([left, height - BORDER]) + scale * (points - low) * [1.0, -1.0]
    labels: list[Label] = []
    arrows = "".join(_arrow(force, places[k], places[k + 1], labels) for k, force in enumerate(forces))
    right, up = axes[0], axes[1]
    return (
        f'<svg viewBox="0 0 {WIDTH:.0f} {height:.0f}" role="img" class="forces" '
        f'aria-label="forces on the platform head to tail, {right} to the right, {up} up">{arrows}'
        f'<text x="4" y="12" class="quiet">{up}</text><text x="26" y="{26:.0f}" class="quiet">{right}</text>'
        '<path d="M8 26V16M8 26H22" class="axes"/></svg>'
    )


def _arrow(force: _PlatformForce, start: Array, end: Array, labels: list[Label]) -> str:
    """An arrow with its name. The name avoids `labels`, the previous labels. The missing force is dashed."""
    way = end - start
    length = float(np.hypot(*way))
    if length < 0.5:
        return ""
    along = way / length
    normal = np.array([-along[1], along[0]])
    head = min(HEAD[0], 0.6 * length)
    neck = end - head * along
    wings = [neck + sign * HEAD[1] * head / HEAD[0] * normal for sign in (1.0, -1.0)]
    kind = ' class="gap"' if force.name == MISSING else ""
    name = ""
    if length >= SHORT:
        x, y, *_ = label = _label(force.name, start, way, normal, labels)
        labels.append(label)
        name = f'<text x="{x:.1f}" y="{y + 4.0:.1f}" text-anchor="middle">{force.name}</text>'
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in (end, *wings))
    return (
        f'<g style="color:{css_color(force.color)}"><line x1="{start[0]:.1f}" y1="{start[1]:.1f}" '
        f'x2="{neck[0]:.1f}" y2="{neck[1]:.1f}"{kind}/><polygon points="{corners}"/>{name}</g>'
    )


def _label(name: str, start: Array, way: Array, normal: Array, labels: list[Label]) -> Label:
    """Label of an arrow, at the first free position beside the arrow, or at the position with the least overlap."""
    across, up = 0.5 * LETTER[0] * len(name), 0.5 * LETTER[1]
    (x, y), (along, down) = start.tolist(), way.tolist()
    right, below = ((BESIDE + abs(normal[0]) * across + abs(normal[1]) * up) * normal).tolist()
    found: list[Label] = []
    for share in SHARES:
        for side in (1.0, -1.0):
            place = min(max(x + share * along + side * right, across), WIDTH - across)
            found.append((place, y + share * down + side * below, across, up))
            if not any(_overlap(found[-1], label) for label in labels):
                return found[-1]
    return min(found, key=lambda one: sum(_overlap(one, label) for label in labels))


def _residual_text(state: Equilibrium, forces: tuple[_PlatformForce, ...], missing: Array | None) -> str:
    force, moment = residual(state, forces)
    left = n(force, ".2g", "N")
    if _can_rotate(state):
        left += f" and {n(moment, '.2g', 'N m')} about the center of mass"
    if missing is None:
        return f"The forces of the cables, weight and load sum to zero up to {left}."
    gap = n(float(np.linalg.norm(missing[:3])), ".4g", "N")
    if np.linalg.norm(missing[3:]) > 0.0:
        gap += f", with a moment of {n(float(np.linalg.norm(missing[3:])), '.4g', 'N m')}"
    return f"The gap is the missing force, {gap}. With it, and cables at their limits, the sum is zero up to {left}."


def _table(state: Equilibrium, forces: tuple[_PlatformForce, ...]) -> str:
    unit, turning = ForceUnit.of(state.one_robot), _can_rotate(state)
    largest = max(float(np.abs(each.wrench[:3]).max()) for each in forces) / unit.newtons
    decimals = 1 if largest >= 99.95 else 2 if largest >= 9.995 else 3  # limited by the width of the table
    columns = [f"{letter}<sub>{axis}</sub>" for letter in ("FM" if turning else "F") for axis in "xyz"]

    def cells(wrench: Array) -> str:
        numbers = wrench[: len(columns)] / unit.newtons
        return "".join(f"<td>{number_text(number, f'.{decimals}f')}</td>" for number in numbers)

    head = "".join(f"<th>{name}</th>" for name in (f"[{unit.name}{f', {unit.name} m' if turning else ''}]", *columns))
    numbered = sorted(forces, key=lambda each: (not each.name.isdigit(), int(each.name) if each.name.isdigit() else 0))
    rows = "".join(f"<tr><td>{swatch(each.color)}{each.name}</td>{cells(each.wrench)}</tr>" for each in numbered)
    total = cells(np.sum([each.wrench for each in forces], axis=0))
    return f'<table class="forces"><tr>{head}</tr>{rows}<tr class="sum"><td>sum</td>{total}</tr></table>'


LONG: Final = 0.22  # length of the longest arrow in the scene, as a share of the robot's size
_ARROW: Final = np.array([0.0045, 0.011, 0.03])  # radii of shaft and head, length of the head, per size of the robot
NOT_AT_REST: Final = "The force balance is shown for a pose at rest, not for a motion or a log."
UNKNOWN: Final = "Neither tensions nor a missing force are known here."


class ProofFeature(Feature):
    """A tab with the force balance of the shown pose, and the forces as arrows in the scene."""

    def __init__(self, page: Page) -> None:
        """Build the tab."""
        self._page, self._nodes = page, Nodes(page.server.scene)
        with page.panel.readings.add_tab("Proof"):
            hint = "Arrows at the platform; the longest arrow always has the same length."
            self._wanted: Any = page.server.gui.add_checkbox("Forces in the scene", False, hint=hint)
            self._html = page.server.gui.add_html("")
        page.refresh_on(self._wanted)

    def follow(self, view: View) -> None:
        """Write the force balance and draw its forces."""
        state, missing = view.state, None
        if state is None and view.missing is not None:
            state, missing = view.missing.state, view.missing.wrench
        if state is None:
            self._html.content = sentence(NOT_AT_REST if not isinstance(view.snapshot, Snapshot) else UNKNOWN)
        else:
            self._html.content = force_polygon_figure(state, missing)
        self.live = bool(self._wanted.value)  # arrows follow every view
        if state is None or not self.live:
            self._nodes.hide("/forces")
            return
        forces, size = forces_on_platform(state, missing), self._page.size
        scale = LONG * size / max(float(np.linalg.norm(each.wrench[:3])) for each in forces)
        ends = np.array([[each.at, each.at + scale * each.wrench[:3]] for each in forces])
        self._nodes.arrows("/forces", ends, [each.color for each in forces], *(_ARROW * size))
