"""`sagline workspace`: volume, boundary and limits of the workspace of a robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import StrEnum
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sagline.cli.ending import OUTSIDE
from sagline.cli.options import (
    USUAL_FORMATS,
    FiguresOption,
    FigureStyle,
    FormatsOption,
    JsonOption,
    ModelName,
    ModelOption,
    OutOption,
    PayloadOption,
    RobotArgument,
    StyleOption,
    TableOption,
    converted_option,
    flag,
    only_with,
    option,
    quantity_option,
)
from sagline.cli.output import Output, TextTable, number_text, show_table
from sagline.cli.terminal import show_note, show_text, working
from sagline.core.errors import FileError, InvalidValueError
from sagline.core.numbers import counted

if TYPE_CHECKING:
    from sagline.interference.pairs import Obstacle
    from sagline.workspaces.criterion import Criterion
    from sagline.workspaces.proof import Proof
    from sagline.workspaces.workspace import Limit, Workspace

MOST_LIMITS = 12  # largest number of limits that are printed
LoadsOption = Annotated[
    Any,
    converted_option(
        "LOADS",
        "Loads in addition to the weight, at all poses: '±100 N, ±20 N m', accelerations '±2 m/s^2, ±1 rad/s^2', both, "
        "or one wrench FX,FY,FZ[,MX,MY,MZ].",
        "wrenches_of",
    ),
]


def _criteria(robot: str, limits: Sequence[float | None], scene: str | None, *, in_frame: bool) -> list[Criterion]:
    """The criteria that the options state, in the order of their limits; without --scene, the robot's scene is used."""
    from sagline.workspaces.criteria import (
        Clearance,
        InFrame,
        LeastFrequency,
        LeastMargin,
        LeastStiffness,
        MaximumSag,
    )

    def with_clearance(limit: float) -> Criterion:
        return Clearance(limit, _obstacles(robot, scene))

    kinds: tuple[Callable[[float], Criterion], ...] = (
        LeastMargin, MaximumSag, LeastStiffness, LeastFrequency, with_clearance
    )  # fmt: skip
    found = [kind(limit) for kind, limit in zip(kinds, limits, strict=True) if limit is not None]
    return found + [InFrame()] * in_frame


def _obstacles(robot: str, scene: str | None) -> tuple[Obstacle, ...]:
    """The obstacles of --scene (a robot file or a mesh file), at least one; without --scene, those of the robot."""
    from sagline.files.mesh_file import load_mesh
    from sagline.files.robot_file import load_scene
    from sagline.robot.catalogue import robot_names

    if scene is None:
        return () if robot in robot_names() else load_scene(robot)
    path = Path(scene)
    if path.suffix.lower() not in ("", ".yaml", ".yml"):
        return (load_mesh(path),)
    if found := () if scene in robot_names() else load_scene(path):
        return found
    raise FileError(path, "has no scene", "Name a robot file with a scene, or a mesh file.")


_TiltOption = Annotated[
    float,
    quantity_option(
        "ANGLE",
        "Angle by which the platform must be able to tilt about any axis, '10deg'. Default: the platform is level.",
        "rad",
        low=0.0,
    ),
]
_BoxOption = Annotated[
    Any,
    converted_option("BOX", "Box of positions: '-2..2, -1..1, 1..3 m'. Default: the robot's frame.", "box_of"),
]
_ReserveOption = Annotated[float | None, quantity_option("FORCE", "Least allowed capacity margin [N].", "N", low=0.0)]
_MaxSagOption = Annotated[
    float | None, quantity_option("LENGTH", "Largest allowed sag of a cable, '5 cm'.", "m", above=0.0)
]
_MinStiffnessOption = Annotated[
    float | None, quantity_option("NUMBER", "Least allowed translational stiffness [N/m].", "N/m", above=0.0)
]
_MinFrequencyOption = Annotated[
    float | None, quantity_option("HZ", "Least allowed natural frequency, with massless cables.", "Hz", above=0.0)
]
_ClearanceOption = Annotated[
    float | None,
    quantity_option("LENGTH", "Least allowed distance between cables, platform and obstacles, '3 cm'.", "m", above=0.0),
]
_SceneOption = Annotated[
    str | None,
    option("FILE", "Obstacles for --clearance: a robot file or a mesh in meters. Default: the robot's scene."),
    only_with("--clearance"),
]


class HullName(StrEnum):
    """Hulls of a workspace: from the exact margin, or from its lower (inner) or upper bound (outer)."""

    EXACT = "exact"
    INNER = "inner"
    OUTER = "outer"


_ToProveOption = Annotated[
    Any, converted_option("BOX", "Prove that all poses of this box are feasible.", "box_of", "--prove")
]
_BudgetOption = Annotated[
    float, quantity_option("TIME", "Largest time for the proof of --prove [s].", "s", above=0.0), only_with("--prove")
]


def workspace(
    name: RobotArgument,
    loads: LoadsOption = None,
    payload: PayloadOption = None,
    tilt: _TiltOption = 0,
    box: _BoxOption = None,
    reserve: _ReserveOption = None,
    max_sag: _MaxSagOption = None,
    min_stiffness: _MinStiffnessOption = None,
    min_frequency: _MinFrequencyOption = None,
    clearance: _ClearanceOption = None,
    scene: _SceneOption = None,
    in_frame: Annotated[bool, flag("Require that the whole platform is within the frame.", "--in-frame")] = False,
    to_prove: _ToProveOption = None,
    budget: _BudgetOption = 10,
    cells: Annotated[int, option("NUMBER", "Cells of the grid along the longest edge of the box.")] = 32,
    hull: Annotated[
        HullName,
        option("HULL", "Hull from the exact margin, or from its lower (inner) or upper bound (outer).", "--hull"),
    ] = HullName.EXACT,
    model: ModelOption = ModelName.CATENARY,
    folder: OutOption = Path("output"),
    figures: FiguresOption = True,
    formats: FormatsOption = USUAL_FORMATS,
    style: StyleOption = FigureStyle.PLAIN,
    table: TableOption = False,
    as_json: JsonOption = False,
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
    from sagline.cli.values import robot_with_payload
    from sagline.files.writing import file_stem
    from sagline.robot.pose import PoseBox
    from sagline.workspaces.proof import ProofVerdict, prove
    from sagline.workspaces.region import Tilts
    from sagline.workspaces.workspace import workspace

    limits = (reserve, max_sag, min_stiffness, min_frequency, clearance)
    cable = model.build()
    if tilt > pi:  # a number without unit is in radians, but the user may have meant degrees
        step = "Give the angle with its unit, --tilt 10deg; it cannot be more than half a turn."
        raise InvalidValueError("--tilt", f"{tilt:g} rad", "0 to 180deg", step)
    robot = robot_with_payload(name, payload)
    criteria = _criteria(name, limits, scene, in_frame=in_frame)
    space_file, mesh, limits_file = "-workspace.nc", "-hull.glb", "-limits.csv"
    parts, drawn = [space_file, mesh, *[limits_file] * table], ["-workspace", "-slice"] if figures else []
    output = Output(folder, file_stem(robot.name), parts, drawn, formats, style)
    with working(f"{robot.name}: workspace") as line:
        how: dict[str, Any] = {"model": cable, "cells": cells, "hull": hull.value, "progress": line.progress}
        space = workspace(robot, box, loads, orientations=Tilts(tilt), criteria=criteria, **how)
        proof = None
        if to_prove is not None:
            claim = PoseBox(to_prove.low, to_prove.high, tilt)
            stage = line.stage(f"{robot.name}: proof")
            proof = prove(robot, claim, loads, budget=budget, model=cable, progress=stage)
        space.save(output.file(space_file))
        if space.nearest is None:
            space.surface.export(output.file(mesh))
            if figures:
                line.stage("drawing")
                _draw(space, output)
        if table:
            output.table(limits_file, _rows_of_limits(space))
    verdict = str(space).partition("\n")[0]
    output.report(lambda: _record(space, proof), verdict, lambda: _tell(space, proof), as_json=as_json)
    if space.nearest is not None:
        show_note("Empty workspace: ", space.nearest.reason, style="bold red")
    proved = proof is None or proof.verdict is ProofVerdict.PROVED_INSIDE
    return 0 if space.nearest is None and proved else OUTSIDE


def _draw(space: Workspace, output: Output) -> None:
    """Draw the workspace, and a slice of it unless it is plane."""
    from sagline import plot

    output.draw(lambda: plot.workspace(space))
    if space.unit == "m³":  # for a plane, the first figure is the slice through the workspace
        output.draw(lambda: plot.slice(space))


def _rows_of_limits(space: Workspace) -> list[list[object]]:
    """Rows of the table of the criteria that limit the workspace; the first row has the names of the columns."""
    rows: list[list[object]] = [
        [limit.criterion, "" if limit.cable < 0 else limit.cable, limit.share] for limit in space.limits
    ]
    return [["criterion", "cable", "share"], *rows]


def _tell(space: Workspace, proof: Proof | None) -> None:
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


def _record_of_proof(proof: Proof) -> dict[str, Any]:
    return {
        "verdict": proof.verdict.name,
        "box_low_m": proof.box.low.tolist(),
        "box_high_m": proof.box.high.tolist(),
        "share_inside": proof.inside,
        "share_outside": proof.outside,
        "share_open": proof.open,
        "boxes_tried": proof.tried,
    }


def _record(space: Workspace, proof: Proof | None) -> dict[str, Any]:
    unit = "m3" if space.unit == "m³" else "m2"
    near = space.nearest
    return {
        "robot": space.robot.name,
        f"volume_{unit}": space.volume,
        f"volume_error_{unit}": space.volume_error,
        f"components_{unit}": space.components.volume.tolist(),
        "components_separate": space.components.separate.tolist(),
        "box_low_m": space.box.low.tolist(),
        "box_high_m": space.box.high.tolist(),
        "open_faces": list(space.open_faces),
        "orientations": str(space.orientations),
        "model": type(space.model).__name__,
        "hull": space.hull,
        "criteria": [str(one) for one in space.criteria],
        "limits": [
            {
                "criterion": limit.criterion,
                "cable": None if limit.cable < 0 else limit.cable,
                "share": limit.share,
            }
            for limit in space.limits
        ],
        "nearest": None
        if near is None
        else {
            "position_m": near.pose.position.tolist(),
            "margin_n": near.margin,
            "cables": list(near.cables),
            "reason": near.reason,
        },
        "proof": None if proof is None else _record_of_proof(proof),
    }
