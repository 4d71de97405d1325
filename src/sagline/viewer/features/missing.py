"""Explanation of an infeasible pose, and the search for the nearest feasible pose."""

from __future__ import annotations

from collections.abc import Hashable
from contextlib import suppress
from html import escape
from typing import Any, Final, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array
from sagline.core.errors import SaglineError
from sagline.core.numbers import n
from sagline.kinematics.inverse import inverse
from sagline.kinematics.status import PoseStatus
from sagline.robot.batch import on_platform
from sagline.robot.pose import Pose
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import Robot
from sagline.tension.margin import unresisted_motion
from sagline.viewer import shapes
from sagline.viewer.feature import BackgroundTask, Feature, View
from sagline.viewer.features.tensions import SHARING
from sagline.viewer.page import Page
from sagline.viewer.readout import chosen_by, definitions, html_block
from sagline.viewer.robot_scene import INFEASIBLE, Nodes
from sagline.viewer.snapshot import MissingWrench, Snapshot, method_name
from sagline.viewer.tension_scale import ForceUnit, cables_text, number_text
from sagline.viewer.workspace import CELLS, DIRECTIONS, WorkspaceQuery, free_directions
from sagline.workspaces.region import region_of
from sagline.workspaces.wrench_sets import WrenchBox

NODES: Final = 15  # nodes of the first grid along each axis
AROUND: Final = 2  # points of a finer grid on each side of its center
STARTS: Final = 4
ITERATIONS: Final = 40
FINEST: Final = 1e-6  # finest grid, relative to the region's size
BLOCK: Final = 250  # positions per call: a few milliseconds, then other threads can run
INWARD: Final = (1e-5, 1e-4, 1e-3, 1e-2)  # steps inward from the boundary, as shares of the region's size


class NearestFeasible(NamedTuple):
    """The nearest feasible pose."""

    pose: Pose
    distance: float  # distance from the given pose [m]
    turned: bool  # True if the orientation differs too


def nearest_feasible(robot: Robot, pose: Pose, model: CableModel, wrench: Array | None) -> NearestFeasible | None:
    """Nearest feasible pose within the robot's region, at the orientation of a pose or level; None if none exists."""
    for turned in (False, True):
        start = Pose(pose.position, np.eye(3)) if turned else pose
        if turned and np.allclose(start.matrix, pose.matrix):
            break
        try:
            found = _nearest_position(robot, pose.position, start, model, wrench)
        except SaglineError:  # the motion pattern excludes this rotation
            continue
        if found is not None:
            there = Pose.from_quaternion(found, start.quaternion)
            return NearestFeasible(there, float(np.linalg.norm(found - pose.position)), turned)
    return None


def _has_levels(robot: Robot) -> bool:
    """True if the workspace of a robot can be computed."""
    return not is_underconstrained(robot) or not on_platform(robot).any()


def _nearest_position(
    robot: Robot, start: Array, orientation: Pose, model: CableModel, wrench: Array | None
) -> Array | None:
    """The feasible position (3,) [m] nearest to `start`, at one orientation; None if none exists."""
    levels = WorkspaceQuery(robot, orientation.quaternion, model, WrenchBox(center=wrench)).levels()
    region = region_of(robot, None, CELLS)
    free = np.flatnonzero(np.any(DIRECTIONS[free_directions(robot, region.flat)] > 0.0, axis=0))
    size = float(np.max(region.high - region.low))

    def grid(axes: list[Array]) -> Array:
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))

    def feasible(places: Array) -> Array:
        parts = [places[k : k + BLOCK] for k in range(0, len(places), BLOCK)]
        held = [np.empty(0, bool), *(levels.details(part).margin >= 0.0 for part in parts)]
        return np.asarray(places[np.concatenate(held)])

    def refined(best: Array) -> Array:
        """The nearest position, by a search from the feasible position `best` on finer and finer grids."""
        step = (region.high - region.low)[free] / (NODES - 1)
        offsets = grid([np.linspace(-1.0, 1.0, 2 * AROUND + 1)] * len(free))
        for _ in range(ITERATIONS):
            places = np.tile(best, (len(offsets), 1))
            places[:, free] += offsets * step
            held = feasible(places[np.linalg.norm(places - start, axis=1) < np.linalg.norm(best - start)])
            if len(held):
                best = held[np.argmin(np.linalg.norm(held - start, axis=1))]
            else:
                step = step / AROUND
                if step.max() < FINEST * size:
                    break
        return best

    axes = [np.linspace(region.low[axis], region.high[axis], NODES) for axis in free]
    nodes = np.tile(start, (NODES ** len(axes), 1))
    nodes[:, free] = grid(axes)
    inside = feasible(nodes)
    if not len(inside):
        return None
    order = np.argsort(np.linalg.norm(inside - start, axis=1))[:STARTS]
    best = min((refined(node) for node in inside[order]), key=lambda at: float(np.linalg.norm(at - start)))
    way = best - start
    way = way / max(float(np.linalg.norm(way)), 1e-12)
    for share in INWARD:  # slightly inside the boundary, where `inverse` has a solution
        place = best + share * size * way
        if inverse(robot, Pose.from_quaternion(place, orientation.quaternion), model, wrench=wrench).feasible:
            return np.asarray(place)
    return None


GO: Final = "go-there"  # topic of the button that moves the platform to the nearest pose
NEGLIGIBLE: Final = 1e-9  # smaller moments, relative to the force at an arm of one meter, count as zero
OTHERWISE: Final = "AnalyticCenter"  # a method that has a solution at every feasible pose


def explanation(
    snapshot: Snapshot, missing: MissingWrench | None, nearest: NearestFeasible | None, *, searching: bool
) -> str:
    """HTML: the missing force, the cables at limits, and the nearest feasible pose with a button to go there."""
    rows = _missing_rows(snapshot, missing) if missing is not None else _other_rows(snapshot)
    if nearest is not None:
        place = ", ".join(number_text(x, ".3f") for x in nearest.pose.position)
        button = f"<button {chosen_by(GO, '')}>Go there</button>"
        level = ", the platform level" if nearest.turned else ""
        rows.append(("Nearest feasible", f"{n(nearest.distance, '.3g', 'm')} away at {place} m{level}. {button}"))
    elif not _has_levels(snapshot.robot):
        rows.append(("Nearest feasible", "not searched for few cables with winches on the platform"))
    elif searching:
        rows.append(("Nearest feasible", "searching …"))
    elif snapshot.status not in (PoseStatus.NOT_COVERED, PoseStatus.UNBOUNDED):
        rows.append(("Nearest feasible", "none within the robot, at this orientation or level"))
    return html_block(definitions(rows, "missing"))


def missing_label(missing: MissingWrench, unit: ForceUnit) -> str:
    """Label of the arrow."""
    text = f"{unit.written(float(np.linalg.norm(missing.force)))} missing"
    return text + (f", and {_moment(missing)}" if _has_moment(missing) else "")


def _missing_rows(snapshot: Snapshot, missing: MissingWrench) -> list[tuple[str, str]]:
    unit = ForceUnit.of(snapshot.robot)
    parts = ", ".join(unit.bare(part) for part in missing.force)
    size = unit.written(float(np.linalg.norm(missing.force)))
    rows = [("Missing force", f"{size}: x, y, z {parts} {unit.name}")]
    if _has_moment(missing):
        turning = ", ".join(number_text(part, ".4g") for part in missing.moment)
        rows = [
            ("Missing force", f"{size}, not sufficient alone: x, y, z {parts} {unit.name}"),
            ("with moment", f"{_moment(missing)}: {turning} N m about x, y, z through the center of mass"),
        ]
    for lower in (True, False):
        cables = [cable for cable, at_lower in missing.limits.items() if at_lower is lower]
        if cables:
            rows.append((f"At {'lower' if lower else 'upper'} limit", cables_text(cables)))
    return rows


def _other_rows(snapshot: Snapshot) -> list[tuple[str, str]]:
    status = snapshot.status
    if status in (PoseStatus.NOT_COVERED, PoseStatus.UNBOUNDED) and snapshot.plan is not None:
        other = OTHERWISE if status is PoseStatus.NOT_COVERED else "MinimumNorm"
        here = escape(method_name(snapshot.plan.tension))
        return [("Method", f"{here} has no solution here. <button {chosen_by(SHARING, other)}>{other}</button>")]
    if status is PoseStatus.SINGULAR:
        with suppress(SaglineError):
            return [("Unconstrained motion", escape(unresisted_motion(snapshot.robot, snapshot.pose).text))]
    return []


def _has_moment(missing: MissingWrench) -> bool:
    return bool(np.linalg.norm(missing.moment) > NEGLIGIBLE * np.linalg.norm(missing.force))


def _moment(missing: MissingWrench) -> str:
    return n(float(np.linalg.norm(missing.moment)), ".4g", "N m")


FEASIBLE: Final = (28, 140, 92)  # color of the platform at the nearest feasible pose
WIDTH, LINE_WIDTH = 5.0, 2.0  # widths of the cables at limits, and of the line to the nearest pose [px]
SMALL: Final = 0.8  # text size, relative to other labels
LONG: Final = 0.2  # length of the arrow, as a share of the robot's size
_ARROW: Final = np.array([0.006, 0.014, 0.04])  # radii of shaft and head, length of the head, per size of the robot
ALONG: Final = (0.32, 0.44, 0.56)  # positions of labels, as shares of a cable from its anchor; different for neighbors

Key = tuple[object, ...]


class MissingFeature(Feature):
    """Text and drawing of the missing force, the cables at limits and the nearest feasible pose."""

    live = True

    def __init__(self, page: Page) -> None:
        """Begin without a drawing."""
        self._page, self._panel, self._nodes = page, page.panel, Nodes(page.server.scene)
        self._body = shapes.Solid.platform(page.robot)
        self._task: BackgroundTask = BackgroundTask(page.later)
        self._key: Key = ()  # key of the shown pose; () while it is feasible
        self._nearest: NearestFeasible | None = None  # nearest feasible pose of the key below
        self._nearest_key: Key = ()  # () before the first computation
        self._shown: tuple[Snapshot, View] | None = None
        page.channel.on(GO, self._go)

    def depends(self, view: View) -> Hashable:
        """Key: the view at an infeasible pose."""
        return view if isinstance(view.snapshot, Snapshot) and not view.snapshot.feasible else None

    def follow(self, view: View) -> None:
        """Explain an infeasible pose. At a feasible pose, remove the explanation."""
        snapshot = view.snapshot
        if not isinstance(snapshot, Snapshot) or snapshot.feasible:
            self._clear()
            return
        self._draw_force(snapshot, view.missing)
        self._draw_limits(snapshot, view.missing)
        model, wrench = _load(snapshot, view)
        load = b"" if wrench is None else wrench.tobytes()
        pose = snapshot.pose
        self._key = (id(snapshot.robot), type(model), pose.position.tobytes(), pose.quaternion.tobytes(), load)
        self._shown = snapshot, view
        if _has_levels(snapshot.robot) and not self._task.busy and self._nearest_key != self._key:
            self._search()
        self._explain()

    def _search(self) -> None:
        assert self._shown is not None
        (snapshot, view), key = self._shown, self._key
        model, wrench = _load(snapshot, view)

        def done(found: NearestFeasible | None) -> None:
            if self._key:
                self._nearest_key, self._nearest = key, found
                self._explain()
                if self._key != key:
                    self._search()

        self._task.start(
            lambda: nearest_feasible(snapshot.robot, snapshot.pose, model, wrench), done, lambda _: done(None)
        )

    def _explain(self) -> None:
        """Write the explanation, and draw the nearest feasible pose; until it is computed, draw the previous one."""
        assert self._shown is not None
        (snapshot, view), nearest = self._shown, self._nearest
        self._panel.explain(explanation(snapshot, view.missing, nearest, searching=self._nearest_key != self._key))
        nodes = self._nodes
        if nearest is None:
            nodes.hide("/nearest", "/nearest_way")
            return
        nodes.body("/nearest", self._body, FEASIBLE, 0.5, nearest.pose)
        text = f"feasible here, {n(nearest.distance, '.3g', 'm')} away"
        nodes.label("/nearest/name", text, (0.0, 0.0, 0.0), "top-center", SMALL)
        ends = np.stack((snapshot.pose.position, nearest.pose.position))[None]
        nodes.lines("/nearest_way", shapes.segments(shapes.straight(ends), dashed=True), FEASIBLE, LINE_WIDTH)

    def _draw_force(self, snapshot: Snapshot, missing: MissingWrench | None) -> None:
        size = 0.0 if missing is None else float(np.linalg.norm(missing.force))
        if missing is None or size == 0.0:
            self._nodes.hide("/missing", "/missing_name")
            return
        start = snapshot.pose.transform(snapshot.robot.center_of_mass)
        tip = start + LONG * self._page.size / size * missing.force
        self._nodes.arrows("/missing", np.stack((start, tip))[None], INFEASIBLE, *(_ARROW * self._page.size))
        self._nodes.label("/missing_name", missing_label(missing, ForceUnit.of(snapshot.robot)), tip)

    def _draw_limits(self, snapshot: Snapshot, missing: MissingWrench | None) -> None:
        """Draw the cables at limits in the colors of these limits, with their names."""
        nodes, scale = self._nodes, self._page.scale
        limits = {} if missing is None else missing.limits
        nodes.keep_first("/limits_names", len(limits))
        if not limits:
            nodes.hide("/limits")
            return
        points = snapshot.courses(1.0)[list(limits)]
        tensions = np.array([scale.low if lower else scale.high for lower in limits.values()])
        colors = np.repeat(scale.linear_colors(tensions), 2 * (points.shape[1] - 1), axis=0).reshape(-1, 2, 3)
        nodes.lines("/limits", shapes.segments(points, dashed=False), colors, WIDTH)
        for k, ((number, lower), cable) in enumerate(zip(limits.items(), points, strict=True)):
            place = cable[round(ALONG[number % len(ALONG)] * (len(cable) - 1))]
            name = f"{number} at its {'lower' if lower else 'upper'} limit"
            nodes.label(f"/limits_names/{k}", name, place, "top-left", SMALL)

    def _clear(self) -> None:
        self._key = self._nearest_key = ()
        self._nearest = None
        self._panel.explain("")
        self._nodes.remove("/limits_names")
        self._nodes.hide("/missing", "/missing_name", "/limits", "/nearest", "/nearest_way")

    def _go(self, _value: Any, _client: int) -> None:
        if self._nearest is not None and self._nearest_key == self._key:
            self._page.go(self._nearest.pose)


def _load(snapshot: Snapshot, view: View) -> tuple[CableModel, Array | None]:
    if snapshot.plan is None:
        return view.settings.model, view.wrench
    return snapshot.plan.state.cables.model, snapshot.plan.state.wrench
