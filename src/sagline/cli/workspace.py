"""`sagline workspace`: volume, boundary and limits of the workspace of a robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import StrEnum
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.ending import OUTSIDE
from sagline.cli.output import Output, TextTable, number_text, show_table, values_of
from sagline.cli.terminal import show_note, show_text, working
from sagline.core.numbers import counted
from sagline.files.writing import file_stem

if TYPE_CHECKING:
    from sagline.interference.pairs import Obstacle
    from sagline.workspaces.workspace import Limit

LIMIT = ("criterion", "cable", "share")
MOST_LIMITS = 12  # largest number of limits that are printed
LoadsOption = Annotated[
    Any,
    opt.converted(
        "LOADS",
        "Loads in addition to the weight, at all poses: '±100 N, ±20 N m', accelerations '±2 m/s^2, ±1 rad/s^2', both, "
        "or one wrench FX,FY,FZ[,MX,MY,MZ].",
        "wrenches_of",
    ),
]


def _criteria(robot: str, limits: Sequence[float | None], scene: str | None, *, in_frame: bool) -> list[sl.Criterion]:
    """The criteria that the options state, in the order of their limits; without --scene, the robot's scene is used."""

    def with_clearance(limit: float) -> sl.Criterion:
        return sl.Clearance(limit, _obstacles(robot, scene))

    kinds: tuple[Callable[[float], sl.Criterion], ...] = (
        sl.LeastMargin, sl.MaximumSag, sl.LeastStiffness, sl.LeastFrequency, with_clearance
    )  # fmt: skip
    found = [kind(limit) for kind, limit in zip(kinds, limits, strict=True) if limit is not None]
    return found + [sl.InFrame()] * in_frame


def _obstacles(robot: str, scene: str | None) -> tuple[Obstacle, ...]:
    """The obstacles of --scene (a robot file or a mesh file), at least one; without --scene, those of the robot."""
    if scene is None:
        return () if robot in sl.robot_names() else sl.load_scene(robot)
    path = Path(scene)
    if path.suffix.lower() not in ("", ".yaml", ".yml"):
        return (sl.load_mesh(path),)
    if found := () if scene in sl.robot_names() else sl.load_scene(path):
        return found
    raise sl.FileError(path, "has no scene", "Name a robot file with a scene, or a mesh file.")


_TiltOption = Annotated[
    float,
    opt.quantity(
        "ANGLE",
        "Angle by which the platform must be able to tilt about any axis, '10deg'. Default: the platform is level.",
        "rad",
        low=0.0,
    ),
]
_BoxOption = Annotated[
    Any,
    opt.converted("BOX", "Box of positions: '-2..2, -1..1, 1..3 m'. Default: the robot's frame.", "box_of"),
]
_ReserveOption = Annotated[float | None, opt.quantity("FORCE", "Least allowed capacity margin [N].", "N", low=0.0)]
_MaxSagOption = Annotated[
    float | None, opt.quantity("LENGTH", "Largest allowed sag of a cable, '5 cm'.", "m", above=0.0)
]
_MinStiffnessOption = Annotated[
    float | None, opt.quantity("NUMBER", "Least allowed translational stiffness [N/m].", "N/m", above=0.0)
]
_MinFrequencyOption = Annotated[
    float | None, opt.quantity("HZ", "Least allowed natural frequency, with massless cables.", "Hz", above=0.0)
]
_ClearanceOption = Annotated[
    float | None,
    opt.quantity("LENGTH", "Least allowed distance between cables, platform and obstacles, '3 cm'.", "m", above=0.0),
]
_SceneOption = Annotated[
    str | None,
    opt.option("FILE", "Obstacles for --clearance: a robot file or a mesh in meters. Default: the robot's scene."),
    opt.only_with("--clearance"),
]


class HullName(StrEnum):
    """Hulls of a workspace: from the exact margin, or from its lower (inner) or upper bound (outer)."""

    EXACT = "exact"
    INNER = "inner"
    OUTER = "outer"


_ToProveOption = Annotated[
    Any, opt.converted("BOX", "Prove that all poses of this box are feasible.", "box_of", "--prove")
]
_BudgetOption = Annotated[
    float,
    opt.quantity("TIME", "Largest time for the proof of --prove [s].", "s", above=0.0),
    opt.only_with("--prove"),
]


def workspace(
    name: opt.RobotArgument,
    loads: LoadsOption = None,
    payload: opt.PayloadOption = None,
    tilt: _TiltOption = 0,
    box: _BoxOption = None,
    reserve: _ReserveOption = None,
    max_sag: _MaxSagOption = None,
    min_stiffness: _MinStiffnessOption = None,
    min_frequency: _MinFrequencyOption = None,
    clearance: _ClearanceOption = None,
    scene: _SceneOption = None,
    in_frame: Annotated[bool, opt.flag("Require that the whole platform is within the frame.", "--in-frame")] = False,
    to_prove: _ToProveOption = None,
    budget: _BudgetOption = 10,
    cells: Annotated[int, opt.option("NUMBER", "Cells of the grid along the longest edge of the box.")] = 32,
    hull: Annotated[
        HullName,
        opt.option("HULL", "Hull from the exact margin, or from its lower (inner) or upper bound (outer).", "--hull"),
    ] = HullName.EXACT,
    model: opt.ModelOption = opt.ModelName.CATENARY,
    folder: opt.OutOption = Path("output"),
    figures: opt.FiguresOption = True,
    formats: opt.FormatsOption = opt.USUAL_FORMATS,
    style: opt.StyleOption = opt.FigureStyle.PLAIN,
    table: opt.TableOption = False,
    as_json: opt.JsonOption = False,
) -> int:
    """Find the workspace of a robot: its volume with an error bar, and the criteria that limit it.

    A pose belongs to the workspace if the sagging cables can balance all loads with tensions within their limits. DIR
    has the workspace in NetCDF, its hull in GLB, and figures. Exit code 1 if the workspace is empty (then the pose
    closest to feasible is printed), or if the box of --prove is not proved completely.

    For example:

        sagline workspace article-suspended
        sagline workspace cogiro --loads "±100 N, ±20 N m" --tilt 10deg
        sagline workspace article-suspended --prove "-2..2, -1..1, 1..3 m"
        sagline workspace ipanema-1 --max-sag "5 cm" --box "-1..1, -1..1, 0..2 m"
    """
    limits = (reserve, max_sag, min_stiffness, min_frequency, clearance)
    cable = model.build()
    if tilt > pi:  # a number without unit is in radians, but the user may have meant degrees
        step = "Give the angle with its unit, --tilt 10deg; it cannot be more than half a turn."
        raise sl.InvalidValueError("--tilt", f"{tilt:g} rad", "0 to 180deg", step)
    robot = opt.robot_with_payload(name, payload)
    criteria = _criteria(name, limits, scene, in_frame=in_frame)
    space_file, mesh, limits_file = "-workspace.nc", "-hull.glb", "-limits.csv"
    parts, drawn = [space_file, mesh, *[limits_file] * table], ["-workspace", "-slice"] if figures else []
    output = Output(folder, file_stem(robot.name), parts, drawn, formats, style)
    with working(f"{robot.name}: workspace") as line:
        how: dict[str, Any] = {"model": cable, "cells": cells, "hull": hull.value, "progress": line.progress}
        space = sl.workspace(robot, box, loads, orientations=sl.Tilts(tilt), criteria=criteria, **how)
        proof = None
        if to_prove is not None:
            claim = sl.PoseBox(to_prove.low, to_prove.high, tilt)
            stage = line.stage(f"{robot.name}: proof")
            proof = sl.prove(robot, claim, loads, budget=budget, model=cable, progress=stage)
        space.save(output.file(space_file))
        if space.nearest is None:
            space.surface.export(output.file(mesh))
            if figures:
                line.stage("drawing")
                _draw(space, output)
        if table:
            output.table(limits_file, [LIMIT, *_rows(space)])
    verdict = str(space).partition("\n")[0]
    output.report(lambda: _record(space, proof), verdict, lambda: _tell(space, proof), as_json=as_json)
    if space.nearest is not None:
        show_note("Empty workspace: ", space.nearest.reason, style="bold red")
    proved = proof is None or proof.verdict is sl.ProofVerdict.PROVED_INSIDE
    return 0 if space.nearest is None and proved else OUTSIDE


def _draw(space: sl.Workspace, output: Output) -> None:
    """Draw the workspace, and a slice of it unless it is plane."""
    output.draw(lambda: sl.plot.workspace(space))
    if space.unit == "m³":  # for a plane, the first figure is the slice through the workspace
        output.draw(lambda: sl.plot.slice(space))


def _rows(space: sl.Workspace) -> list[tuple[object, ...]]:
    """Criterion, cable (None if there is none) and share of each limit of the workspace."""
    return [(limit.criterion, None if limit.cable < 0 else limit.cable, limit.share) for limit in space.limits]


def _tell(space: sl.Workspace, proof: sl.Proof | None) -> None:
    from sagline.workspaces.workspace import amount_of, facts_of, span_of

    facts = [("area" if space.unit == "m²" else "volume", amount_of(space))]
    facts += [(head, text) for head, text in facts_of(space) if head != "nearest"]
    show_table(TextTable(["robot", space.robot.name], facts, left=frozenset({0, 1}), prose=frozenset({1})))
    if limits := space.limits:
        show_table(_limits(limits))
    if proof is not None:
        spans = span_of(proof.box)
        shares = {"proved inside": proof.inside, "proved outside": proof.outside, "open": proof.open}
        rows = [
            [word, number_text(100.0 * share, ".2f"), f"{share * proof.volume:.4g}"] for word, share in shares.items()
        ]
        show_table(TextTable([f"{spans} m", "share [%]", "volume [m³]"], rows))
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
    unit = "m3" if space.unit == "m³" else "m2"
    near = space.nearest
    return {
        "robot": space.robot.name,
        **values_of(space, f"volume_{unit}", f"volume_error_{unit}"),
        f"components_{unit}": space.components.volume,
        "components_separate": space.components.separate,
        **_ends(space.box),
        "open_faces": space.open_faces,
        "orientations": str(space.orientations),
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
