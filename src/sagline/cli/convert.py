"""`sagline convert` and the commands `export-...`: files for other tools, controllers, machines and simulations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.output import file_of, write_or_show
from sagline.cli.terminal import show_note, show_text
from sagline.core.numbers import n
from sagline.files.writing import create_folder

LEAST = 1e-6  # smallest position error that is printed [m]
ENDINGS = {"robot": (".yaml", ".yml"), "mjcf": (".xml", ".mjcf"), "javascript": (".json",)}
WITH_STIFFNESS, WITH_DENSITY = opt.only_with("--axial-stiffness"), opt.only_with("--linear-density")
KINDS = {"robot": "a robot file", "mjcf": "a MuJoCo model", "javascript": "a robot for JavaScript"}


def convert(
    source: str = opt.argument(
        opt.NEEDED,
        "SOURCE",
        "A WireX file, robot.wcrfx; the folder of a CASPR robot, or its .xml; a robot file; or a preset.",
    ),
    out: Path | None = opt.STDOUT,
    form: str = opt.choice(
        "robot",
        "KIND",
        "robot: a robot file in YAML; mjcf: a MuJoCo model with straight cables; javascript: JSON for JavaScript.",
        tuple(KINDS),
        "--kind",
    ),
    linear_density: float | None = opt.quantity(
        None, "QUANTITY", "Linear density of all cables, for instance '65 g/m'.", "kg/m", WITH_STIFFNESS
    ),
    axial_stiffness: float | None = opt.quantity(
        None, "QUANTITY", "Axial stiffness EA of all cables, for instance '700 kN'.", "N", WITH_DENSITY
    ),
    cable_set: str | None = opt.option(None, "NAME", "CASPR: name of the cable set. Default: that of the file."),
    at: tuple[str, str, str] | None = opt.option(
        None, "X Y Z", "MuJoCo: initial position of the platform [m]. Default: middle of the test box."
    ),
) -> None:
    r"""Convert a robot of CASPR or WireX to a robot file, or any robot to a MuJoCo model or to JSON.

    Assumptions are printed on stderr and written into the robot file, and so are the data of the input that are lost.

    For example:

        sagline convert robot.wcrfx --out robot.yaml
        sagline convert robot.wcrfx --out my_robot.yaml \
            --linear-density "20 g/m" --axial-stiffness "50 kN"
        sagline convert cogiro --kind mjcf --out cogiro.xml
        sagline convert cogiro --kind javascript --out cogiro.json
    """
    from sagline.core.arrays import FARTHEST
    from sagline.files.quantity import decimal_numbers

    out = out if out is None else file_of(out, f"{Path(source).stem}{ENDINGS[form][0]}")
    if out is not None and Path(source).exists() and out.resolve() == Path(source).resolve():
        raise sl.FileError(out, "is the file to convert", "Name another file with --out.")
    if out is not None and out.suffix.lower() not in ENDINGS[form]:
        step = f"Let it end in {ENDINGS[form][0]}, or choose another --kind."
        raise sl.FileError(out, f"is not a valid name for {KINDS[form]}", step)
    if at is not None and form != "mjcf":
        step = f"{KINDS[form].capitalize()} contains no pose. Leave the option out."
        raise sl.InvalidValueError("--at", f"given for {KINDS[form]}", "--kind mjcf", step)
    place = None if at is None else decimal_numbers(at, "--at", "m", FARTHEST)
    cables = None
    if linear_density is not None and axial_stiffness is not None:  # one of them alone is rejected
        cables = sl.Cable(linear_density, axial_stiffness)
    imported = _read(source, cables, cable_set)
    if form == "robot":
        text = sl.dump_robot(imported.robot)
    elif form == "javascript":
        from sagline.share.machine import javascript_text

        text = javascript_text(imported.robot)
    else:
        text, straightness = _mjcf(imported.robot, place)
        imported = replace(imported, lost=(*imported.lost, straightness))
    write_or_show(text, out)
    _report(imported, out)


def _read(source: str, cables: sl.Cable | None, cable_set: str | None) -> sl.Imported:
    path = Path(source)
    is_caspr = path.suffix.lower() == ".xml" or path.is_dir()
    if cable_set is not None and not is_caspr:
        raise sl.InvalidValueError("--cable-set", repr(cable_set), "none except for CASPR", "Leave it out.")
    if path.suffix.lower() == ".wcrfx":
        return sl.load_wirex(path, cables)
    if is_caspr:
        return sl.load_caspr(path, cables, cable_set)
    robot = sl.load_robot(source)
    return sl.Imported(robot if cables is None else robot.replace(cables=cables), ())


def _mjcf(robot: sl.Robot, at: list[float] | None) -> tuple[str, str]:
    """The MuJoCo model of `robot`, and a sentence on the position error that tendons without sag and weight cause."""
    if at is None and robot.test_box is None:
        raise sl.InvalidValueError("--at", "missing", "X Y Z in m", "Give the initial position of the platform.")
    position = at if at is not None else 0.5 * (robot.test_box.low + robot.test_box.high)  # type: ignore[union-attr]
    pose = sl.Pose.from_euler(position, 0.0, 0.0, 0.0)
    text = sl.dump_mjcf(robot, pose)
    proof = sl.confirm(sl.inverse(robot, pose, model=sl.Elastic()))
    away = float(np.linalg.norm(proof.position_error))
    far = f"hold the platform {n(1e3 * max(away, LEAST), '.2g', 'mm')} away"
    held = far if proof.held else "do not hold the platform near it"
    return text, f"Sag and weight of the cables: sagging cables of these lengths {held}."


def _report(imported: sl.Imported, out: Path | None) -> None:
    robot = imported.robot
    show_note(f"{robot.name}: ", f"{robot.cable_count} cables, {robot.motion_pattern}" + (f", in {out}" if out else ""))
    for field, why in robot.assumed.items():
        show_note("Assumed: ", f"{field}: {why}")
    for what in imported.lost:
        show_note("Lost: ", what)


def export_c(
    robot: str = opt.ROBOT,
    out: Path = opt.out(Path("sagline.c")),
    tension: list[str] | None = opt.choice(None, "METHOD", "Tension distribution method", opt.TENSIONS),
    variable: Any = opt.VARIABLE,
    forward: bool = opt.flag(False, "Write the forward kinematics too.", "--forward"),
    single_precision: bool = opt.flag(
        False, "Single precision, for controllers without double precision in hardware.", "--float"
    ),
) -> None:
    """Write the kinematics of a robot as C99 source for a microcontroller, and cable lengths as SCL source for a PLC.

    The source has the kernels of sagline, including pulleys. They compute the tensions and lengths of a pose and, with
    --forward, the pose of given lengths. The source needs no heap, and every call returns a status. The header and the
    SCL file are written next to the source. --tension can be repeated.

    For example:

        sagline export-c article-prototype --out sagline.c
        sagline export-c own_robot.yaml --out robot.c --float --forward
        sagline export-c cogiro --tension minimum-norm --tension centroid
    """
    from sagline.robot.batch import refuse_slanted

    loaded = sl.load_robot(robot)
    methods = [opt.tension_named(each, variable) for each in tension or ["closest"]]
    target = file_of(out, "sagline.c")
    refuse_slanted(loaded)  # before the folder exists
    create_folder(target.parent)
    source, header, scl = sl.export_c(
        loaded, target, tension=methods, forward=forward, single_precision=single_precision
    )
    precision = "single" if single_precision else "double"
    show_note(f"{loaded.name}: ", f"{loaded.cable_count} cables, {loaded.motion_pattern}, {precision} precision")
    show_text(f"{source}: C99; cc -std=c99 -O2 -ffp-contract=off -c {source.name}", whole=True)
    show_text(f"{header}: the declarations", whole=True)
    show_text(f"{scl}: P3 in SCL for a Siemens PLC, not compiled yet", whole=True)


def export_scl(robot: str = opt.ROBOT, out: Path = opt.out(Path("plc.scl"))) -> None:
    """Write SCL source for the PLCs of a robot: data blocks, limits, and the program of one group, for TIA Portal.

    The program accepts commands of one controller at a time. It enforces the limits, and slows the winches down when
    commands are missing. It has not been compiled yet; the comment at its head lists the settings of the CPU.

    For example:

        sagline export-scl article-prototype --out plc.scl
    """
    from sagline.control.link import groups_of

    loaded = sl.load_robot(robot)
    target = file_of(out, "plc.scl")
    create_folder(target.parent)
    path = sl.export_scl(loaded, target)
    groups = len(groups_of(loaded.cable_count))
    show_text(f"{path}: SCL for the {groups} PLCs of {loaded.name}, not compiled yet", whole=True)


def export_fmu(
    robot: str = opt.ROBOT,
    out: Path = opt.out(Path("sagline.fmu")),
    pose: Any = opt.POSE,
    inputs: Any = opt.choice("speeds", "INPUTS", "Inputs of the winches", ("speeds", "lengths")),
    fmi: Any = opt.choice("3", "VERSION", "Version of the interface", ("2", "3")),
    winches: Any = opt.WINCHES,
    step: float | None = opt.STEP,
) -> None:
    """Write a robot with winches and a platform as a unit of co-simulation (FMU), for Simulink, Dymola and others.

    The unit computes the motion as `sagline simulate` does: inputs are winch speeds or lengths and a wrench on the
    platform, outputs are pose, twist, tensions and lengths. It contains the compiled library and its C source.

    For example:

        sagline export-fmu cogiro --out cogiro.fmu
        sagline export-fmu own_robot.yaml --fmi 2 --inputs lengths --pose 0,0,1.5
    """
    loaded = sl.load_robot(robot)
    target = file_of(out, "sagline.fmu")
    create_folder(target.parent)
    path = sl.export_fmu(loaded, target, start=pose, inputs=inputs, fmi=int(fmi), winches=winches, step=step)
    show_text(f"{path}: {loaded.name} for FMI {fmi}, with {inputs} of {loaded.cable_count} winches", whole=True)


def export_linuxcnc(
    robot: str = opt.ROBOT,
    out: Path = opt.out(Path("cablekins.c")),
    pose: Any = opt.POSE,
    unit: Any = opt.choice("mm", "UNIT", "Unit of lengths of the machine", ("mm", "inch", "m")),
    tension: str = opt.TENSION,
) -> None:
    """Write the kinematics of a robot as a module for LinuxCNC: forward and inverse with sagging cables.

    The module is a C source, which `halcompile --install` compiles. A file with settings for the INI file of the
    machine is written beside it; the lengths at --pose are the home positions.

    For example:

        sagline export-linuxcnc cogiro --out cablekins.c
        sagline export-linuxcnc own_robot.yaml --unit inch --out my_kins.c
    """
    loaded = sl.load_robot(robot)
    target = file_of(out, "cablekins.c")
    if target.suffix != ".c":
        raise sl.FileError(target, "is not a valid name for a C source", f"Let it end in .c: {target.stem}.c.")
    source, settings = sl.export_linuxcnc(
        loaded, target.parent, name=target.stem, unit=unit, tension=opt.tension_named(tension), home=pose
    )
    show_text(f"{source}: kinematics of {loaded.name}; halcompile --install {source.name}", whole=True)
    show_text(f"{settings}: settings for the INI file of the machine", whole=True)
