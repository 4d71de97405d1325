"""`sagline calibrate`: the parameters of a robot from its log, or a plan of the poses to measure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Final, NamedTuple

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
VALIDATION: Final = ("folds", "position_m", "position_before_m", "tension_n", "tension_before_n")


class _Request(NamedTuple):
    """Options of the fit and of the choice of poses. `deviations`: standard deviations from options, by sensor."""

    robot: str
    unknowns: tuple[str, ...] | None
    deviations: dict[str, Any]
    files: tuple[Path, ...]
    plot: Path | None
    style: opt.FigureStyle

    def check_files(self, suffixes: tuple[str, ...]) -> None:
        """Reject files with other suffixes, the robot's own file, and files that cannot be written."""
        for file, allowed in [*((file, suffixes) for file in self.files), *[(self.plot, FIGURES)] * bool(self.plot)]:
            assert file is not None
            if file.suffix.lower() not in allowed:
                kinds = ", ".join(allowed)
                raise sl.FileError(file, f"the suffix is {file.suffix or 'missing'}; allowed: {kinds}", "Choose one.")
            if file.resolve() == Path(self.robot).resolve():
                raise sl.FileError(file, "is the input robot file; its comments would be lost", "Give another name.")
            check_files(file.parent, [file.name])


def _deviation_option(quantity: str, unit: str) -> Any:
    return opt.quantity("NUMBER", f"Standard deviation of {quantity}. Default: that of the log.", unit, above=0.0)


def calibrate(
    robot: opt.RobotArgument,
    log: Annotated[
        Path | None,
        opt.argument(
            "LOG", "CSV file, one row per pose: count_0, ... or length_0, ...; load_cell_0, ...; x, y, z if measured."
        ),
        opt.only_without("--plan"),
    ] = None,
    out: Annotated[list[Path] | None, opt.out_option("none")] = None,
    unknowns: Annotated[
        str | None,
        opt.option(
            "NAMES",
            "Unknown parameters, with commas between. Default: "
            "frame_anchors,length_zero,axial_stiffness,mass,center_of_mass, and with load cells "
            "load_cell_gain,load_cell_bias.",
        ),
    ] = None,
    length_deviation: Annotated[float | None, _deviation_option("a length or counted length, '0.5 mm'", "m")] = None,
    tension_deviation: Annotated[float | None, _deviation_option("a load cell's reading, '5 N'", "N")] = None,
    position_deviation: Annotated[float | None, _deviation_option("a measured coordinate, '1 mm'", "m")] = None,
    rotation_deviation: Annotated[float | None, _deviation_option("a measured rotation, '1 mrad'", "rad")] = None,
    folds: Annotated[
        int, opt.option("NUMBER", "Groups of poses for the cross-validation; 0 for none."), opt.only_without("--plan")
    ] = 5,
    robust: Annotated[
        bool, opt.flag("Give outliers less weight.", "--robust/--no-robust"), opt.only_without("--plan")
    ] = True,
    model: Annotated[opt.ModelOption, opt.only_without("--plan")] = opt.ModelName.CATENARY,
    plot: Annotated[
        Path | None, opt.option("FILE", "Figure of the fit: .png, .svg or .pdf."), opt.only_without("--plan")
    ] = None,
    plan: Annotated[int | None, opt.option("NUMBER", "Without LOG: choose this number of poses to measure.")] = None,
    seed: Annotated[opt.SeedOption, opt.only_with("--plan")] = 0,
    style: Annotated[opt.FigureStyle, opt.STYLE, opt.only_with("--plot")] = opt.FigureStyle.PLAIN,
    write_table: Annotated[opt.TableOption, opt.only_without("--plan")] = False,
    as_json: opt.JsonOption = False,
) -> int:
    """Estimate anchors, zeros and cables of a robot from its own readings.

    LOG has the readings of encoders and load cells at several poses, and optionally those of a measuring system. The
    result has the parameters with standard errors, the combinations that no reading observes, and the outliers.
    --out writes the calibrated robot (.yaml), the whole result (.nc), or both into a folder; it can be repeated.
    --plan chooses poses and tensions before the measurement and predicts the standard errors; --out then writes the
    poses (.yaml). Exit code 1 if the fit did not converge or contradicts the model or the deviations.

    For example:

        sagline calibrate winches_robot.yaml winches.csv --out calibrated.yaml
        sagline calibrate winches_robot.yaml winches.csv --folds 10 --out found.nc
        sagline calibrate winches_robot.yaml --plan 40 --out poses.yaml
    """
    names = None if unknowns is None else tuple(name.strip() for name in unknowns.split(","))
    deviations = {
        "length_deviation": length_deviation,
        "tension_deviation": tension_deviation,
        "position_deviation": position_deviation,
        "rotation_deviation": rotation_deviation,
    }
    known = {name: value for name, value in deviations.items() if value is not None}
    names_of_files = ("poses.yaml",) if plan is not None else ("calibrated.yaml", "calibration.nc")
    files = _files(robot, out or (), names_of_files)
    if write_table:
        files += _files(robot, [files[0].parent if files else Path("output")], ("calibration.csv",))
    request = _Request(robot, names, known, files, plot, style)
    if plan is not None:
        return _plan_poses(request, plan, seed, as_json=as_json)
    return _fit(request, log, model.build(), folds, robust=robust, as_json=as_json)


def _files(robot: str, out: Iterable[Path], names: Iterable[str]) -> tuple[Path, ...]:
    """The files of `--out`; in a folder, their names are the robot's name and these endings."""
    stem = file_stem(Path(robot).stem)
    folders = {place: [place / f"{stem}-{name}" for name in names] for place in out if not is_file(place)}
    return tuple(file for place in out for file in folders.get(place, [place]))


def _fit(request: _Request, log: Path | None, model: sl.CableModel, folds: int, *, robust: bool, as_json: bool) -> int:
    """Calibrate, write and print the result; returns the exit code."""
    from sagline.calibration import summary

    if log is None:
        step = "Give the file of the readings, or choose poses with --plan 40."
        raise sl.InvalidValueError("LOG", "missing", "a CSV file, or --plan", step)
    if log.suffix.lower() in (*ROBOTS, WHOLE):
        step = "Give the file of the readings of encoders and load cells, such as winches.csv."
        raise sl.FileError(log, "is not a CSV file of readings", step)
    request.check_files((*ROBOTS, WHOLE, TABLE))
    robot, readings = sl.load_robot(request.robot), _log(log, request.deviations)
    with working(f"{robot.name}: calibrating from {len(readings):,} rows") as line:
        found = sl.calibrate(
            robot, readings, request.unknowns, model=model, robust=robust, folds=folds, progress=line.progress
        )
        files = _written(found, request, line)
    if as_json:
        show_json({**_record(found), "files": files})
    else:
        _show_lines(lambda width: summary.calibration_text(found, width))
        _tell_files(files)
        _tell_offset(found, files)
    if found.status is sl.CalibrationStatus.FOUND:
        return 0
    show_note(f"{robot.name}: ", found.status.text, style="bold red")
    if found.status is sl.CalibrationStatus.NOT_CONVERGED and len(files) < len(request.files):
        show_note("", "No robot file is written, because the fit did not converge.")
    return OUTSIDE


def _plan_poses(request: _Request, count: int, seed: int, *, as_json: bool) -> int:
    """Choose poses, write and print them; returns the exit code."""
    from sagline.calibration import planning

    request.check_files(ROBOTS)
    robot = sl.load_robot(request.robot)
    with working(f"{robot.name}: choosing {count:,} poses") as line:
        sensors = sl.Sensors(**request.deviations) if request.deviations else None
        chosen = sl.calibration_poses(robot, count, request.unknowns, sensors, seed=seed, progress=line.progress)
        for file in request.files:
            create_folder(file.parent)
            chosen.save(file)
    if as_json:
        show_json({**_record_of_poses(chosen), "files": list(request.files)})
        return 0
    _show_lines(lambda width: f"{planning.poses_text(chosen, width)}\n{planning.poses_table(chosen, width)}")
    _tell_files(request.files)
    return 0


def _log(file: Path, deviations: dict[str, float]) -> sl.WinchLog:
    """The log; deviations on the command line replace the deviations in the comments of the file."""
    from sagline.files.log_file import sensors_of_comments
    from sagline.files.reading import read_text
    from sagline.files.table import TABLE_LIMIT

    if not deviations:
        return sl.load_log(file)
    sensors, _ = sensors_of_comments(read_text(file, TABLE_LIMIT), file)
    return sl.load_log(file, sensors.replace(**deviations))


def _written(found: sl.Calibration, request: _Request, line: Any) -> list[Path]:
    """Write the result, the figure and, if the fit has converged, the robot; returns the files."""
    from sagline.core.table import csv_text

    files = []
    for file in request.files:
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
    if request.plot is not None:
        line.stage("drawing")
        create_folder(request.plot.parent)
        with request.style.active():
            figure = sl.plot.calibration(found)
        sl.plot.save(figure, request.plot)
        files.append(request.plot)
    return files


def _show_lines(text: Callable[[int], str]) -> None:
    """Print a text that depends on the width of the terminal."""
    from sagline.calibration import summary

    show_pieces(lambda _, width: [(Text(printable(line)), 0) for line in text(min(width, summary.WIDTH)).splitlines()])


def _tell_files(files: Iterable[Path]) -> None:
    for file in files:
        show_text(f"In {file.resolve().parent}: {file.name}", whole=True)


def _tell_offset(found: sl.Calibration, files: list[Path]) -> None:
    """Print the zero offsets of measured lengths as a note, because a robot file does not contain them."""
    robots = [file.name for file in files if file.suffix.lower() in ROBOTS]
    if robots and found.length_offset.any():
        whole = next((file.name for file in files if file.suffix.lower() == WHOLE), None)
        kept = f"{whole} keeps it" if whole else "--out found.nc does"
        text = "has no length_zero for measured lengths; add it to the lengths of the machine"
        show_note("Note: ", f"{robots[0]} {text}; {kept}.", style="bold")


def _rows(found: sl.Calibration) -> Iterator[Sequence[object]]:
    """The heads of the columns, then one row per parameter: value, standard error and prior value."""
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
