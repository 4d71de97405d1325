"""`sagline calibrate`: parameters of a robot from its log, or a plan of the poses to measure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
from rich.text import Text

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.ending import OUTSIDE
from sagline.cli.output import is_file, values_of
from sagline.cli.terminal import show_json, show_note, show_pieces, show_text, working
from sagline.core.errors import printable
from sagline.files.writing import check_files, create_folder, file_stem, write_text

ROBOTS: Final = (".yaml", ".yml")
WHOLE: Final = ".nc"
TABLE: Final = ".csv"
FIGURES: Final = (".png", ".svg", ".pdf")
NO_PLAN: Final = opt.only_without("--plan")
VALIDATION: Final = ("folds", "position_m", "position_before_m", "tension_n", "tension_before_n")


def _deviation(quantity: str, unit: str) -> float | None:
    return opt.quantity(None, "NUMBER", f"Standard deviation of {quantity}. Default: that of the log.", unit, above=0.0)


@dataclass(frozen=True)
class _Options:
    """Options of the fit and of the choice of poses. A standard deviation of None means that of the log."""

    columns: Path | None = opt.option(None, "FILE", "Map of columns for a LOG with other names (.yaml).", NO_PLAN)
    rest: float | None = opt.quantity(
        None, "TIME", "Average each rest of at least this time in a LOG with motion, '1 s'.", "s", NO_PLAN, above=0.0
    )
    out: list[Path] | None = opt.out(None, "none")
    unknowns: str | None = opt.option(
        None,
        "NAMES",
        "Unknown parameters, separated by commas; 'axial_stiffness*=10 %' means one common value (*; [] one per "
        "cable) with a standard deviation of the robot's value. Default: "
        "frame_anchors,length_zero,axial_stiffness,mass,center_of_mass, and with load cells "
        "load_cell_gain,load_cell_bias, and with swivel angles swivel_zero, with frequencies inertia.",
    )
    also: str | None = opt.option(None, "NAMES", "Further unknowns beside the default ones: 'measuring_frame,target'.")
    length_deviation: float | None = _deviation("a length or counted length, '0.5 mm'", "m")
    tension_deviation: float | None = _deviation("a load cell's reading, '5 N'", "N")
    position_deviation: float | None = _deviation("a measured coordinate, '1 mm'", "m")
    rotation_deviation: float | None = _deviation("a measured rotation, '1 mrad'", "rad")
    swivel_deviation: float | None = _deviation("a measured swivel angle, '5 mrad'", "rad")
    frequency_deviation: float | None = _deviation("a measured natural frequency, '0.02 Hz'", "Hz")
    folds: int = opt.option(5, "NUMBER", "Groups of poses for the cross-validation; 0 for none.", NO_PLAN)
    robust: bool = opt.flag(True, "Give outliers less weight.", "--robust/--no-robust", NO_PLAN)
    model: str = opt.if_only(opt.MODEL, NO_PLAN)
    plot: Path | None = opt.option(None, "FILE", "Figure of the fit: .png, .svg or .pdf.", NO_PLAN)
    plan: int | None = opt.option(None, "NUMBER", "Without LOG: choose this number of poses to measure.")
    seed: int = opt.seed(0, opt.only_with("--plan"))
    style: str = opt.if_only(opt.STYLE, opt.only_with("--plot"))
    table: bool = opt.if_only(opt.TABLE, NO_PLAN)
    as_json: bool = opt.JSON

    def parameters(self, robot: sl.Robot) -> list[str | sl.Unknown] | None:
        """Unknown parameters; None for the default ones."""
        named = ",".join(part for part in (self.unknowns or (self.also and "default"), self.also) if part)
        return [_unknown(text.strip(), robot) for text in named.split(",")] if named else None

    @property
    def deviations(self) -> dict[str, float]:
        """The given standard deviations, by field of `Sensors`."""
        names = (each.name for each in fields(self) if each.name.endswith("_deviation"))
        return {name: value for name in names if (value := getattr(self, name)) is not None}

    def files(self, robot: str) -> list[Path]:
        """Files of `out`. In a folder, the names of files begin with the name of `robot`."""
        stem = file_stem(Path(robot).stem)
        names = ["poses.yaml"] if self.plan is not None else ["calibrated.yaml", "calibration.nc"]
        files = []
        for place in self.out or ():
            files += [place] if is_file(place) else [place / f"{stem}-{name}" for name in names]
        folder = files[0].parent if files else Path("output")
        return files + [folder / f"{stem}-calibration.csv"] * self.table

    def check_files(self, robot: str, suffixes: tuple[str, ...]) -> None:
        """Reject files with other suffixes, the file `robot`, and files that cannot be written."""
        plots = [] if self.plot is None else [(self.plot, FIGURES)]
        for file, allowed in [*((file, suffixes) for file in self.files(robot)), *plots]:
            if file.suffix.lower() not in allowed:
                kinds = ", ".join(allowed)
                raise sl.FileError(file, f"the suffix is {file.suffix or 'missing'}; allowed: {kinds}", "Choose one.")
            if file.resolve() == Path(robot).resolve():
                raise sl.FileError(file, "is the input robot file; its comments would be lost", "Give another name.")
            check_files(file.parent, [file.name])


def _unknown(text: str, robot: sl.Robot) -> str | sl.Unknown:
    """Unknown of a text such as "mass", "drum_radius*=10 %" or "length_zero[]=20 mm"."""
    from sagline.calibration.parameters import KINDS
    from sagline.files.quantity import in_si, plain_number
    from sagline.robot.tolerances import value_of

    name, equals, size = (part.strip() for part in text.partition("="))
    bare = name.removesuffix("*").removesuffix("[]").rstrip()
    shared = {"*": True, "[]": False}.get(name[len(bare) :].strip())
    if not equals:
        return name if shared is None else sl.Unknown(bare, shared)
    kind, item = KINDS[sl.Unknown(bare).name], f"{bare}: deviation"
    relative = kind.logarithmic or not kind.unit
    share = plain_number(size.removesuffix("%").rstrip()) if size.endswith("%") and relative else None
    if share is not None:
        return sl.Unknown(bare, shared, share / 100.0)
    number = cast(float, in_si(size, kind.unit, item))
    own = value_of(robot, bare) if kind.logarithmic else None
    if own is not None and np.ptp(own) > 0.0:
        step = "Give it in percent, or as tolerance in the robot file."
        raise sl.InvalidValueError(item, size, "percent, because the cables have different values", step)
    return sl.Unknown(bare, shared, number if own is None else number / float(own.flat[0]))


def calibrate(
    robot: str = opt.ROBOT,
    log: Path | None = opt.argument(
        None,
        "LOG",
        "CSV file, one row per pose: count_0, ... or length_0, ...; load_cell_0, ...; x, y, z if measured. Or an .npz "
        "or .mat file.",
        NO_PLAN,
    ),
    given: _Options = _Options(),
) -> int:
    """Estimate anchors, zero lengths and cables of a robot from its own readings.

    LOG has the readings of encoders and load cells at several poses, and optionally those of a measuring system. The
    result has the parameters with standard errors, the combinations of parameters that no reading observes, and the
    outliers. --out writes the calibrated robot (.yaml), the whole result (.nc), or both into a folder; it can be
    repeated. --plan chooses poses and tensions before the measurement and predicts the standard errors; --out then
    writes the poses (.yaml). Exit code 1 if the fit did not converge or contradicts the model or the deviations.

    For example:

        sagline calibrate winches_robot.yaml winches.csv --out calibrated.yaml
        sagline calibrate winches_robot.yaml winches.csv --folds 10 --out found.nc
        sagline calibrate winches_robot.yaml --plan 40 --out poses.yaml
    """
    return _fit(robot, log, given) if given.plan is None else _plan_poses(robot, given.plan, given)


def _fit(name: str, log: Path | None, given: _Options) -> int:
    from sagline.calibration import summary
    from sagline.files.log_file import read_log

    if log is None:
        step = "Give the file of the readings, or choose poses with --plan 40."
        raise sl.InvalidValueError("LOG", "missing", "a CSV file, or --plan", step)
    if log.suffix.lower() in (*ROBOTS, WHOLE):
        step = "Give the file of the readings of encoders and load cells, such as winches.csv."
        raise sl.FileError(log, "is not a CSV file of readings", step)
    given.check_files(name, (*ROBOTS, WHOLE, TABLE))
    robot, readings = sl.load_robot(name), read_log(log, None, given.columns, given.deviations)
    if given.rest is not None:
        readings = readings.at_rest(given.rest)
    with working(f"{robot.name}: calibrating from {len(readings):,} rows") as line:
        how: dict[str, Any] = {"robust": given.robust, "folds": given.folds, "progress": line.progress}
        found = sl.calibrate(robot, readings, given.parameters(robot), model=given.model, **how)
        files = _written(found, given.files(name), given, line)
    if given.as_json:
        show_json({**_record(found), "files": files})
    else:
        _show_lines(lambda width: summary.calibration_text(found, width))
        _tell_files(files)
        _tell_offset(found, files)
    if found.status is sl.CalibrationStatus.FOUND:
        return 0
    show_note(f"{robot.name}: ", found.status.text, style="bold red")
    if found.status is sl.CalibrationStatus.NOT_CONVERGED and len(files) < len(given.files(name)):
        show_note("", "No robot file is written, because the fit did not converge.")
    return OUTSIDE


def _plan_poses(name: str, count: int, given: _Options) -> int:
    from sagline.calibration import planning

    given.check_files(name, ROBOTS)
    robot, files = sl.load_robot(name), given.files(name)
    with working(f"{robot.name}: choosing {count:,} poses") as line:
        sensors = sl.Sensors(**given.deviations) if given.deviations else None
        how: dict[str, Any] = {"seed": given.seed, "progress": line.progress}
        chosen = sl.calibration_poses(robot, count, given.parameters(robot), sensors, **how)
        for file in files:
            create_folder(file.parent)
            chosen.save(file)
    if given.as_json:
        show_json({**_record_of_poses(chosen), "files": files})
        return 0
    _show_lines(lambda width: f"{planning.poses_text(chosen, width)}\n{planning.poses_table(chosen, width)}")
    _tell_files(files)
    return 0


def _written(found: sl.Calibration, wanted: list[Path], given: _Options, line: Any) -> list[Path]:
    """Write the result and the figure, and the robot if the fit has converged. Returns the files."""
    from sagline.core.results import csv_text

    files = []
    for file in wanted:
        create_folder(file.parent)
        if file.suffix.lower() == WHOLE:
            found.save(file)
        elif file.suffix.lower() == TABLE:
            write_text(file, csv_text(_rows(found)))
        elif found.status is not sl.CalibrationStatus.NOT_CONVERGED:
            write_text(file, sl.dump_robot(found.robot))
        else:
            continue
        files.append(file)
    if given.plot is not None:
        line.stage("drawing")
        create_folder(given.plot.parent)
        with opt.figure_style(given.style):
            figure = sl.plot.calibration(found)
        sl.plot.save(figure, given.plot)
        files.append(given.plot)
    return files


def _show_lines(text: Callable[[int], str]) -> None:
    from sagline.calibration import summary

    show_pieces(lambda _, width: [(Text(printable(line)), 0) for line in text(min(width, summary.WIDTH)).splitlines()])


def _tell_files(files: Iterable[Path]) -> None:
    for file in files:
        show_text(f"In {file.resolve().parent}: {file.name}", whole=True)


def _tell_offset(found: sl.Calibration, files: list[Path]) -> None:
    """Print a note about the zero offset of measured lengths, because a robot file does not contain this number."""
    robots = [file.name for file in files if file.suffix.lower() in ROBOTS]
    if robots and (found.length_offset.any() or (found.length_scale != 1.0).any()):
        whole = next((file.name for file in files if file.suffix.lower() == WHOLE), None)
        kept = f"{whole} keeps it" if whole else "--out found.nc does"
        scaled = "multiply them by length_scale and " * bool((found.length_scale != 1.0).any())
        text = f"has no length_zero for measured lengths; {scaled}add it to the lengths of the machine"
        show_note("Note: ", f"{robots[0]} {text}; {kept}.", style="bold")


def _rows(found: sl.Calibration) -> Iterator[Sequence[object]]:
    """Heads of the columns, then one row per parameter: value, standard error and prior value."""
    numbers = found.parameters
    yield "name", "value", "standard error", "before", "unit"
    yield from zip(numbers.labels, found.values, found.standard_error, numbers.prior, numbers.units, strict=True)


def _record(found: sl.Calibration) -> dict[str, Any]:
    check = found.cross_validation
    return {
        "robot": found.robot.name,
        "status": found.status.name,
        **values_of(found, "log", "date", "chi_squared", "degrees_of_freedom", "chi_squared_of_all", "iterations"),
        "numbers": [
            dict(zip(("name", "value", "standard_error", "before", "unit"), row, strict=True))
            for row in list(_rows(found))[1:]
        ],
        "rows": len(found.rows),
        "left_out": {reason.name: rows for reason, rows in found.left_out.items()},
        "outliers": [values_of(one, "row", "cable", "quantity", "size") for one in found.outliers],
        "gauge": [values_of(one, "name", "step") for one in found.gauge],
        "cannot_tell_apart": [values_of(one, "name", "known", "step") for one in found.cannot_tell_apart],
        "criticisms": [values_of(one, "name", "fall", "chance", "moves", "change") for one in found.criticisms],
        "cross_validation": None if check is None else values_of(check, *VALIDATION),
    }


def _record_of_poses(chosen: sl.CalibrationPoses) -> dict[str, Any]:
    numbers = chosen.parameters
    return {
        "robot": chosen.robot.name,
        **values_of(chosen.poses, "position_m", "quaternion"),
        **values_of(chosen, "frame_end_tension_n", "unstrained_length_m"),
        "numbers": [
            {"name": label, "expected_error": error, "random_error": random, "unit": unit}
            for label, error, random, unit in zip(
                numbers.labels, chosen.expected_error, chosen.random_error, numbers.units, strict=True
            )
        ],
        **values_of(chosen, "enough", "most_helpful"),
    }
