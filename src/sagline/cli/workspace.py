"""`sagline workspace`: where a robot can work, how much that is, and what limits it where."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from sagline.cli.ending import OUTSIDE
from sagline.cli.entries import CLEARANCES, INVERSE, PROOFS, SIGNED_MARGINS, VIBRATION
from sagline.cli.options import (
    JsonOption,
    Model,
    ModelOption,
    OutOption,
    PayloadOption,
    RobotArgument,
    figures_flag,
    flag,
    option,
)
from sagline.cli.output import Grid, Output, show_table, written
from sagline.cli.terminal import note, show, show_json, working
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import counted

if TYPE_CHECKING:
    from sagline.interference.pairs import Obstacle
    from sagline.workspaces.criterion import Criterion
    from sagline.workspaces.proof import Proof
    from sagline.workspaces.space import Workspace

MOST_LIMITS = 12  # shares that are told
LoadsOption = Annotated[
    str | None,
    option(
        "LOADS",
        "Loads that the platform bears all over it besides its weight: '±100 N, ±20 N m', accelerations "
        "'±2 m/s^2, ±1 rad/s^2', both, or one wrench FX,FY,FZ[,MX,MY,MZ].",
    ),
]


def _criteria(robot: str, limits: dict[str, str | None], scene: str | None, *, in_frame: bool) -> list[Criterion]:
    """The criteria of the options; a robot's own scene stands around it unless another one is given."""
    from sagline.cli.values import quantity
    from sagline.workspaces.criteria import (
        Clearance,
        InFrame,
        LeastFrequency,
        LeastMargin,
        LeastStiffness,
        MaximumSag,
    )

    kinds: dict[str, tuple[Callable[[float], Criterion], str]] = {
        "reserve": (LeastMargin, "N"),
        "max_sag": (MaximumSag, "m"),
        "min_stiffness": (LeastStiffness, "N/m"),
        "min_frequency": (LeastFrequency, "Hz"),
        "clearance": (lambda limit: Clearance(limit, around(robot if scene is None else scene)), "m"),
    }
    found: list[Criterion] = []
    for name, text in limits.items():
        if text is not None:
            kind, unit = kinds[name]
            bound = {"low" if name == "reserve" else "above": 0.0}
            found.append(kind(quantity(text, f"--{name.replace('_', '-')}", unit, **bound)))
    if scene is not None and limits["clearance"] is None:
        step = 'Say how near things may come: --clearance "3 cm".'
        raise InvalidValueError("--scene", f"{scene!r} without --clearance", "both", step)
    return found + [InFrame()] * in_frame


def around(name: str) -> tuple[Obstacle, ...]:
    """Obstacles: the scene of a robot file, a mesh file, none for the name of a preset."""
    from sagline.files.mesh_file import load_mesh
    from sagline.files.robot_file import load_scene

    path = Path(name)
    if path.suffix.lower() in (".yaml", ".yml"):
        return load_scene(path)
    return (load_mesh(path),) if path.suffix else ()


def workspace(
    name: RobotArgument,
    wrench: LoadsOption = None,
    payload: PayloadOption = None,
    tilt: Annotated[
        str | None, option("ANGLE", "The platform has to tilt so far about any axis, '10deg'. Default: it is level.")
    ] = None,
    box: Annotated[
        str | None, option("BOX", "Where to look: '-2..2, -1..1, 1..3 m'. Default: the robot's frame.")
    ] = None,
    reserve: Annotated[str | None, option("FORCE", "Margin that is left everywhere [N].")] = None,
    max_sag: Annotated[str | None, option("LENGTH", "No cable sags further, '5 cm'.")] = None,
    min_stiffness: Annotated[
        str | None, option("NUMBER", "A force moves the platform no further than force over this [N/m].")
    ] = None,
    min_frequency: Annotated[str | None, option("HZ", "The platform swings no slower, cables without mass.")] = None,
    clearance: Annotated[str | None, option("LENGTH", "Cables, and what they pass, stay so far apart, '3 cm'.")] = None,
    scene: Annotated[
        str | None,
        option("FILE", "With --clearance: a robot file with a scene, or a mesh in meters. Default: the robot's scene."),
    ] = None,
    in_frame: Annotated[bool, flag("The whole platform stays within the frame.", "--in-frame")] = False,
    to_prove: Annotated[str | None, option("BOX", "Prove that it can work in all of this box.", "--prove")] = None,
    budget: Annotated[str, option("TIME", "Of the proof [s].")] = "10",
    cells: Annotated[int, option("NUMBER", "Cells of the grid along the longest edge of the box.")] = 32,
    model: ModelOption = Model.CATENARY,
    folder: OutOption = Path("output"),
    figures: Annotated[bool, figures_flag("Draw hull and slice, as PNG and SVG.")] = True,
    as_json: JsonOption = False,
) -> int:
    """Find where a robot can work: volume with its error bar, and what limits it where.

    The platform can be held wherever the cables, as they sag, bear all loads within their limits. DIR has the workspace
    in NetCDF, its hull in GLB and figures. Exit code 1 where it is empty, when the nearest pose is told, and where not
    all of the box of --prove is proved.

    For example:

        sagline workspace article-suspended
        sagline workspace cogiro --wrench "±100 N, ±20 N m" --tilt 10deg
        sagline workspace article-suspended --prove "-2..2, -1..1, 1..3 m"
        sagline workspace ipanema-1 --max-sag "5 cm" --box "-1..1, -1..1, 0..2 m"
    """
    from sagline.cli.values import box_of, quantity, robot_with, wrenches_of
    from sagline.files.writing import file_stem
    from sagline.workspaces.orientations import Tilts
    from sagline.workspaces.proof import ProofVerdict, prove
    from sagline.workspaces.workspace import workspace

    limits = {
        "reserve": reserve,
        "max_sag": max_sag,
        "min_stiffness": min_stiffness,
        "min_frequency": min_frequency,
        "clearance": clearance,
    }
    cable = model.build()
    loads, criteria = wrenches_of(wrench), _criteria(name, limits, scene, in_frame=in_frame)
    angle = 0.0 if tilt is None else quantity(tilt, "--tilt", "rad", low=0.0)
    if angle > np.pi:  # a number alone counts in radians
        step = "Give its unit, --tilt 10deg: no rotation turns by more than half a turn."
        raise InvalidValueError("--tilt", repr(tilt), "0 to 180deg", step)
    region = None if box is None else box_of(box, "--box")
    claim = None if to_prove is None else box_of(to_prove, "--prove", angle)
    seconds = quantity(budget, "--budget", "s", above=0.0)
    robot = robot_with(name, payload)
    space_file, hull = f"{file_stem(robot.name, 'workspace')}.nc", f"{file_stem(robot.name, 'hull')}.glb"
    drawn = [file_stem(robot.name, what) for what in ("workspace", "slice") if figures]
    output = Output(folder, [space_file, hull], drawn)
    with working(f"{robot.name}: workspace", *_entries(limits), *[PROOFS] * (claim is not None)) as line:
        space = workspace(
            robot,
            region,
            loads,
            orientations=Tilts(angle),
            criteria=criteria,
            model=cable,
            cells=cells,
            progress=line.progress,
        )
        proof = None
        if claim is not None:
            told = line.stage(f"{robot.name}: proof")
            proof = prove(robot, claim, loads, budget=seconds, model=cable, progress=told)
        space.save(output.file(space_file))
        if space.nearest is None:
            space.surface.export(output.file(hull))
            if figures:
                from sagline import plot

                line.stage("drawing")
                output.draw(plot.workspace(space))
                if space.unit == "m³":  # of a plane the first figure is the slice
                    output.draw(plot.slice(space))
    if as_json:
        show_json(
            {**_record(space), "proof": None if proof is None else _record_of_proof(proof), "files": output.files}
        )
    else:
        _tell(space)
        if proof is not None:
            _tell_proof(proof)
        output.show()
    if space.nearest is not None:
        note("Nowhere: ", space.nearest.reason, style="bold red")
    proved = proof is None or proof.verdict is ProofVerdict.PROVED_INSIDE
    return 0 if space.nearest is None and proved else OUTSIDE


def _entries(limits: dict[str, str | None]) -> tuple[str, ...]:
    """Entries of the kernels for these limits."""
    given = {name for name, text in limits.items() if text is not None}
    shaken, near = bool(given & {"min_stiffness", "min_frequency"}), "clearance" in given
    tensions = shaken or near or "max_sag" in given
    return (SIGNED_MARGINS, *[INVERSE] * tensions, *[VIBRATION] * shaken, *[CLEARANCES] * near)


def _tell(space: Workspace) -> None:
    from sagline.workspaces.space import amount_of, facts_of

    facts = [("area" if space.unit == "m²" else "volume", amount_of(space))]
    facts += [(head, text) for head, text in facts_of(space) if head != "nearest"]
    show_table(Grid(["robot", space.robot.name], facts, left=frozenset({0, 1}), prose=frozenset({1})))
    limits = space.limits
    if not limits:
        return
    rows = [
        [written(100.0 * limit.share, ".1f"), limit.criterion, "–" if limit.cable < 0 else str(limit.cable)]
        for limit in limits[:MOST_LIMITS]
    ]
    if len(limits) > MOST_LIMITS:
        rest = sum(limit.share for limit in limits[MOST_LIMITS:])
        rows.append([written(100.0 * rest, ".1f"), counted(len(limits) - MOST_LIMITS, "other"), ""])
    show_table(Grid(["surface [%]", "limited by", "cable"], rows, left=frozenset({1})))


def _tell_proof(proof: Proof) -> None:
    from sagline.workspaces.space import span_of

    spans = span_of(proof.box)
    shares = ((f"proved {word}", getattr(proof, word)) for word in ("inside", "outside"))
    rows = [
        [word, written(100.0 * share, ".2f"), f"{share * proof.volume:.4g}"]
        for word, share in (*shares, ("open", proof.open))
    ]
    show_table(Grid([f"{spans} m", "share [%]", "volume [m³]"], rows))
    show(f"{proof.verdict.name}: {proof.verdict.text}.")


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


def _record(space: Workspace) -> dict[str, Any]:
    unit = "m3" if space.unit == "m³" else "m2"
    near = space.nearest
    return {
        "robot": space.robot.name,
        f"volume_{unit}": space.volume,
        f"volume_error_{unit}": space.volume_error,
        f"components_{unit}": space.components.volume.tolist(),
        "box_low_m": space.box.low.tolist(),
        "box_high_m": space.box.high.tolist(),
        "open_faces": list(space.open_faces),
        "orientations": str(space.orientations),
        "model": type(space.model).__name__,
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
    }
