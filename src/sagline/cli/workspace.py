"""`sagline workspace`: volume, boundary and limits of the workspace of a robot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Any

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.ending import OUTSIDE
from sagline.cli.output import Output, TextTable, number_text, values_of
from sagline.cli.terminal import show_note, show_text, working
from sagline.core.numbers import counted
from sagline.files.writing import file_stem

if TYPE_CHECKING:
    from sagline.cli.terminal import ProgressLine
    from sagline.interference.pairs import Obstacle
    from sagline.workspaces.workspace import Limit

LIMIT = ("criterion", "cable", "share")
MOST_LIMITS = 12  # largest number of limits that are printed


@dataclass(frozen=True)
class _Limits:
    """Options that state criteria."""

    reserve: float | None = opt.quantity(None, "FORCE", "Least allowed capacity margin [N].", "N", low=0.0)
    max_sag: float | None = opt.quantity(None, "LENGTH", "Largest allowed sag of a cable, '5 cm'.", "m", above=0.0)
    min_stiffness: float | None = opt.quantity(
        None, "NUMBER", "Least allowed translational stiffness [N/m].", "N/m", above=0.0
    )
    min_frequency: float | None = opt.quantity(
        None, "HZ", "Least allowed natural frequency, with massless cables.", "Hz", above=0.0
    )
    clearance: float | None = opt.quantity(
        None, "LENGTH", "Least allowed distance between cables, platform and obstacles, '3 cm'.", "m", above=0.0
    )
    scene: str | None = opt.option(
        None,
        "FILE",
        "Obstacles for --clearance: a robot file or a mesh in meters. Default: the robot's scene.",
        opt.only_with("--clearance"),
    )
    in_frame: bool = opt.flag(False, "Require that the whole platform is within the frame.", "--in-frame")

    def criteria(self, robot: str) -> Iterator[sl.Criterion]:
        """The criteria that the options state. Without --scene, the obstacles are those of the robot file `robot`."""
        kinds = sl.LeastMargin, sl.MaximumSag, sl.LeastStiffness, sl.LeastFrequency
        limits = self.reserve, self.max_sag, self.min_stiffness, self.min_frequency
        yield from (kind(limit) for kind, limit in zip(kinds, limits, strict=True) if limit is not None)
        if self.clearance is not None:
            yield sl.Clearance(self.clearance, _obstacles(robot, self.scene))
        if self.in_frame:
            yield sl.InFrame()


def _obstacles(robot: str, scene: str | None) -> tuple[Obstacle, ...]:
    """The obstacles in the robot file or mesh file `scene`, at least one. If it is None, those of the file `robot`."""
    if scene is None:
        return () if robot in sl.robot_names() else sl.load_scene(robot)
    path = Path(scene)
    if path.suffix.lower() not in ("", ".yaml", ".yml"):
        return (sl.load_mesh(path),)
    if found := () if scene in sl.robot_names() else sl.load_scene(path):
        return found
    raise sl.FileError(path, "has no scene", "Name a robot file with a scene, or a mesh file.")


def workspace(
    name: str = opt.ROBOT,
    loads: Any = opt.converted(
        None,
        "LOADS",
        "Loads in addition to the weight, at all poses: '±100 N, ±20 N m', accelerations '±2 m/s^2, ±1 rad/s^2', both, "
        "or one wrench FX,FY,FZ[,MX,MY,MZ].",
        "wrenches_of",
    ),
    payload: float | None = opt.PAYLOAD,
    tilt: float = opt.quantity(
        0,
        "ANGLE",
        "Angle by which the platform must be able to tilt about any axis, '10deg'. Default: the platform is level.",
        "rad",
        low=0.0,
    ),
    box: Any = opt.converted(None, "BOX", "Box of positions: '-2..2, -1..1, 1..3 m'. Default: the frame.", "box_of"),
    limits: _Limits = _Limits(),
    to_prove: Any = opt.converted(None, "BOX", "Prove that all poses of this box are feasible.", "box_of", "--prove"),
    budget: float = opt.quantity(
        10, "TIME", "Largest time for the proof of --prove [s].", "s", opt.only_with("--prove"), above=0.0
    ),
    cells: int = opt.option(32, "NUMBER", "Cells of the grid along the longest edge of the box."),
    hull: str = opt.choice(
        "exact",
        "HULL",
        "Hull from the exact margin, from its lower bound (inner) or from its upper bound (outer).",
        ("exact", "inner", "outer"),
        "--hull",
    ),
    given: Any = opt.GIVEN,
    model: str = opt.MODEL,
    files: opt.Files = opt.Files(),
) -> int:
    """Find the workspace of a robot: its volume with an error bar, and the criteria that limit it.

    A pose belongs to the workspace if the sagging cables can balance all loads with tensions within their limits. DIR
    has the workspace in NetCDF, its hull in GLB, and figures. If the workspace is empty, the pose closest to
    feasible is printed. Exit code 1 if the workspace is empty, or if the box of --prove is not proved completely.

    For example:

        sagline workspace article-suspended
        sagline workspace cogiro --loads "±100 N, ±20 N m" --tilt 10deg
        sagline workspace article-suspended --prove "-2..2, -1..1, 1..3 m"
        sagline workspace ipanema-1 --max-sag "5 cm" --box "-1..1, -1..1, 0..2 m"
    """
    from sagline.workspaces.proof import check_provable

    if tilt > pi:  # a number without unit is in radians, but the user may have meant degrees
        step = "Give the angle with its unit, --tilt 10deg; it cannot be more than half a turn."
        raise sl.InvalidValueError("--tilt", f"{tilt:g} rad", "0 to 180deg", step)
    robot = opt.robot_with_payload(name, payload)
    criteria = list(limits.criteria(name))
    parts, drawn = ["-workspace.nc", "-hull.glb"], ["-workspace", "-slice"]
    output = Output(files, file_stem(robot.name), parts, drawn, "-limits.csv")
    if to_prove is not None:
        check_provable(robot)
    with working(f"{robot.name}: workspace") as line:
        how: dict[str, Any] = {"model": model, "cells": cells, "hull": hull, "progress": line.progress}
        space = sl.workspace(robot, box, loads, orientations=sl.Tilts(tilt), criteria=criteria, given=given, **how)
        proof = None
        if to_prove is not None:
            stage, inside = line.stage(f"{robot.name}: proof"), sl.PoseBox(to_prove.low, to_prove.high, tilt)
            proof = sl.prove(robot, inside, loads, budget=budget, model=model, progress=stage)
        _write(space, output, line)
    verdict = str(space).partition("\n")[0]
    output.report(lambda: _record(space, proof), verdict, lambda: _tell(space, proof))
    if space.nearest is not None:
        show_note("Empty workspace: ", space.nearest.reason, style="bold red")
    proved = proof is None or proof.verdict is sl.ProofVerdict.PROVED_INSIDE
    return 0 if space.nearest is None and proved else OUTSIDE


def _write(space: sl.Workspace, output: Output, line: ProgressLine) -> None:
    space.save(output.file("-workspace.nc"))
    if space.nearest is None:
        space.surface.export(output.file("-hull.glb"))
        line.stage("drawing")
        output.draw(lambda: sl.plot.workspace(space))
        if space.unit == "m³":  # for a plane, the first figure is the slice through the workspace
            output.draw(lambda: sl.plot.slice(space))
    output.table("-limits.csv", lambda: [LIMIT, *_rows(space)])


def _rows(space: sl.Workspace) -> list[tuple[object, ...]]:
    """Criterion, cable and share of each limit of the workspace. The cable is None for limits of the platform."""
    return [(limit.criterion, None if limit.cable < 0 else limit.cable, limit.share) for limit in space.limits]


def _tell(space: sl.Workspace, proof: sl.Proof | None) -> None:
    from sagline.workspaces.workspace import amount_of, facts_of, span_of

    facts = [("area" if space.unit == "m²" else "volume", amount_of(space))]
    facts += [(head, text) for head, text in facts_of(space) if head != "nearest"]
    TextTable(["robot", space.robot.name], facts, left=frozenset({0, 1}), prose=frozenset({1})).show()
    if limits := space.limits:
        _limits(limits).show()
    if proof is not None:
        spans = span_of(proof.box)
        shares = {"proved inside": proof.inside, "proved outside": proof.outside, "open": proof.open}
        rows = [[word, number_text(100.0 * part, ".2f"), f"{part * proof.volume:.4g}"] for word, part in shares.items()]
        TextTable([f"{spans} m", "share [%]", "volume [m³]"], rows).show()
        show_text(f"{proof.verdict.name}: {proof.verdict.text}.")


def _limits(limits: Sequence[Limit]) -> TextTable:
    rows = [
        [number_text(100.0 * limit.share, ".1f"), limit.criterion, "–" if limit.cable < 0 else str(limit.cable)]
        for limit in limits[:MOST_LIMITS]
    ]
    if len(limits) > MOST_LIMITS:
        rest = sum(limit.share for limit in limits[MOST_LIMITS:])
        rows.append([number_text(100.0 * rest, ".1f"), counted(len(limits) - MOST_LIMITS, "other"), ""])
    return TextTable(["surface [%]", "limited by", "cable"], rows, left=frozenset({1}))


def _ends(box: sl.PoseBox) -> dict[str, Any]:
    return {"box_low_m": box.low, "box_high_m": box.high}


def _record(space: sl.Workspace, proof: sl.Proof | None) -> dict[str, Any]:
    from sagline.workspaces.workspace import orientations_text

    unit = "m3" if space.unit == "m³" else "m2"
    near = space.nearest
    return {
        "robot": space.robot.name,
        **values_of(space, f"volume_{unit}", f"volume_error_{unit}"),
        f"components_{unit}": space.components.volume,
        "components_separate": space.components.separate,
        **_ends(space.box),
        "open_faces": space.open_faces,
        "orientations": orientations_text(space),
        "model": type(space.model).__name__,
        "hull": space.hull,
        "criteria": [str(one) for one in space.criteria],
        "limits": [dict(zip(LIMIT, row, strict=True)) for row in _rows(space)],
        "nearest": None
        if near is None
        else {"position_m": near.pose.position, **values_of(near, "margin_n", "cables", "reason")},
        "proof": None
        if proof is None
        else {
            "verdict": proof.verdict.name,
            **_ends(proof.box),
            **{f"share_{part}": getattr(proof, part) for part in ("inside", "outside", "open")},
            "boxes_tried": proof.tried,
        },
    }
