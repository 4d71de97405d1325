"""Text of a calibration, in lines of 80 columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from textwrap import wrap
from typing import Final, Literal

import numpy as np
from scipy.special import bdtrc

from sagline.calibration.findings import UNITS, CalibrationStatus, Direction, Findings, Outlier, sensor_deviations
from sagline.calibration.identifiability import easiest_measurement
from sagline.calibration.parameters import KINDS, OF_FORCES, Parameters
from sagline.core.arrays import Array, Indices
from sagline.core.numbers import SPACE, counted, n, plus_minus
from sagline.kernels import codes

WIDTH: Final = 80
CLEARLY: Final = 4.0  # standard deviations by which chi squared is below its expected value if it is too small
FAR: Final = 4.0  # a value is far from its prior if the difference exceeds this number of prior deviations
SEEN: Final = 0.999  # a value is observed if its standard error is below this share of its prior deviation
MANY: Final = 4  # a sensor with fewer outliers is not reported as faulty
CHANCE: Final = 1e-3  # a sensor is faulty if the probability that chance gives it so many outliers is below this value
MOST_OUTLIERS: Final = 12  # largest number of listed outliers; a last line counts the other outliers
MOST_ROWS: Final = 8  # largest number of listed rows of the log; the text counts the other rows
SMALL: Final = {"m": (1e3, "mm"), "N": (1.0, "N"), "rad": (1e3, "mrad"), "Hz": (1.0, "Hz")}  # factor, written unit
ANCHORS: Final[tuple[Anchors, ...]] = ("frame_anchors", "platform_anchors")


def calibration_text(found: Findings, width: int = WIDTH) -> str:
    """Text of a calibration in lines of at most `width` characters; the verdict comes first."""
    parts = (
        _verdict(found, width),
        _rows(found, width),
        _sensors(found, width),
        _criticisms(found, width),
        _departures(found, width),
        _values(found, width),
        _directions(found.gauge, "Unobservable; the values of the robot file are kept:", width),
        _directions(found.cannot_tell_apart, "Weakly identifiable:", width),
        _outliers(found, width),
        _held(found, width),
        _cross_validation(found, width),
    )
    return "\n".join(line for part in parts for line in part)


def table(found: Findings) -> str:
    """Table with one value per line: the value, its standard error, its prior and its change."""
    numbers = found.parameters
    head = ("number", "found", "before", "change, in prior deviations")
    rows = [head]
    for k, label in enumerate(numbers.labels):
        unit, prior = numbers.units[k], numbers.prior_deviation[k]
        moved = n((found.values[k] - numbers.prior[k]) / prior, ".2f") if np.isfinite(prior) else "–"
        now = plus_minus(found.values[k], found.standard_error[k], unit)
        rows.append((label, now, plus_minus(numbers.prior[k], prior, unit), moved))
    widths = [max(len(row[column]) for row in rows) for column in range(len(head))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )


def outlier_text(outlier: Outlier) -> str:
    """Text of an outlier with row of the log, cable and size."""
    where = "" if outlier.cable is None else f", cable {outlier.cable}"
    size = n(outlier.size, ".3g", UNITS.get(outlier.quantity, ""))
    times = n(outlier.deviations, ".2g")
    return f"row {outlier.row}{where}: {outlier.quantity} {size} off ({times} deviations)"


def _row_ranges(rows: Sequence[int] | Indices) -> str:
    """Text of increasing row indices with ranges, such as "rows 3, 17 to 19 and 5 more"."""
    spans: list[list[int]] = []
    for row in map(int, rows):
        if spans and row == spans[-1][1] + 1:
            spans[-1][1] = row
        else:
            spans.append([row, row])
    shown, rest = spans[:MOST_ROWS], sum(last - first + 1 for first, last in spans[MOST_ROWS:])
    names = [str(first) if first == last else f"{first} to {last}" for first, last in shown]
    more = f" and {rest:,} more" if rest else ""
    return f"{'row' if len(rows) == 1 else 'rows'} {', '.join(names)}{more}"


def chi_squared_text(found: Findings) -> str:
    """Text with chi squared and its expected value."""
    freedom = found.degrees_of_freedom
    if freedom <= 0:
        return f"chi squared {n(found.chi_squared, '.4g')} without degrees of freedom: nothing confirms the values"
    text = f"chi squared {_with_expected(found.chi_squared, freedom)}"
    whole, of_all = found.chi_squared_of_all
    if of_all not in (freedom, 0):
        less = int(np.count_nonzero(found.weights < 1.0))
        which = f"with {counted(less, 'pose')} of less weight, " if less else ""
        text += f"; {which}without outliers, {_with_expected(whole, of_all)}"
    if found.chi_squared < freedom - CLEARLY * (2.0 * freedom) ** 0.5:
        text += "; the readings are better than the stated deviations"
    return text


def _with_expected(chi_squared: float, freedom: int) -> str:
    """Text with chi squared, its expected value and its expected standard deviation."""
    spread = f"{freedom:,}{SPACE}±{SPACE}{n((2.0 * freedom) ** 0.5, '.2g')}"
    return f"{n(chi_squared, ',.0f')}, expected {spread}"


def _verdict(found: Findings, width: int) -> Iterator[str]:
    """Lines with the status of the calibration; reasons for doubt come first."""
    source = found.log or "the log"
    what = f"{len(found.values)} numbers of {found.robot.name} from {counted(len(found.rows), 'pose')} of {source}"
    when = f", {found.date}" if found.date else ""
    iterations = counted(found.iterations, "iteration")
    if found.status is CalibrationStatus.FOUND:
        yield from _wrapped(f"Found: {what}{when}", width)
        yield from _wrapped(f"{chi_squared_text(found)}; {iterations}", width, "  ")
    elif found.status is CalibrationStatus.DOUBTFUL:
        text = found.status.text.removeprefix("found, but ")
        yield from _wrapped(f"DOUBTFUL: {chi_squared_text(found)}: {text}", width)
        yield from _wrapped(f"{what}{when}; {iterations}", width, "  ")
    else:
        yield from _wrapped(f"{found.status.text[:1].upper()}{found.status.text[1:]}", width)
        yield from _wrapped(f"{what}{when}; {iterations}; {chi_squared_text(found)}", width, "  ")


def _rows(found: Findings, width: int) -> Iterator[str]:
    """Lines with the number of used rows, and the number of omitted rows for each reason."""
    left = {reason: rows for reason, rows in found.left_out.items() if len(rows)}
    count = sum(map(len, left.values()))
    if not count:
        yield f"Rows: all {len(found.rows):,} were used"
        return
    yield f"Rows: {len(found.rows):,} of {len(found.rows) + count:,} were used, {count:,} left out:"
    for reason, rows in left.items():
        yield from _wrapped(f"{reason.text}: {_row_ranges(rows)}", width, "  ")


def _sensors(found: Findings, width: int) -> Iterator[str]:
    """Lines with the standard deviations of the sensors from the residuals."""
    if found.status is CalibrationStatus.NOT_CONVERGED or not (deviations := sensor_deviations(found)):
        return
    parts = []
    for one in deviations:
        name, (scale, unit) = f"{one.quantity}s", SMALL[UNITS[one.quantity]]
        stated = n(scale * one.stated, ".3g", unit)
        now = plus_minus(scale * one.found, scale * one.error, prefixed=False)
        scatter = f"{name} scatter by {now}{SPACE}{unit} ({stated} stated)"
        parts.append(scatter if np.isfinite(one.found) else f"the log does not determine the scatter of {name}")
    doubt = "; a wrong model also increases these values" if found.status is CalibrationStatus.DOUBTFUL else ""
    yield from _wrapped(f"Sensors: {'; '.join(parts)}{doubt}", width)


def _criticisms(found: Findings, width: int) -> Iterator[str]:
    """Lines of the fixed parameters that the readings contradict."""
    if not found.criticisms:
        return
    yield "Contradicted by the readings, although not estimated:"
    for one in found.criticisms:
        unit = found.parameters.units[found.parameters.labels.index(one.moves)]
        by = f"{n(one.change, '+.2g', unit)}, {n(one.deviations, '.2g')} standard errors"
        fall = f"chi squared would fall by {n(one.fall, ',.0f')} (probability by chance {n(one.chance, '.1g')})"
        text = f"- {one.name}: {fall}, and {one.moves} would change by {by}"
        yield from _wrapped(f"{text}; add {one.kind} to the unknowns, or correct it", width, "  ", "    ")


def _departures(found: Findings, width: int) -> Iterator[str]:
    """Lines of the values that differ from the robot file by more than `FAR` prior standard deviations."""
    numbers = found.parameters
    off = numbers.missed(numbers.internal(found.values))
    far = np.flatnonzero(np.abs(off) > FAR)
    if far.size:
        yield f"Far from the robot file, by more than {n(FAR, '.2g')} prior deviations:"
    for k in far:
        now = plus_minus(found.values[k], found.standard_error[k], numbers.units[k])
        before = plus_minus(numbers.prior[k], numbers.prior_deviation[k], numbers.units[k])
        text = f"- {numbers.labels[k]}: {now}, before {before}; {easiest_measurement([numbers.names[k]])}"
        yield from _wrapped(text, width, "  ", "    ")


def _held(found: Findings, width: int) -> Iterator[str]:
    """Lines with the parameters that were not estimated."""
    observed = [
        name for name, kind in KINDS.items() if kind.is_observed(found.sensors, counted=found.parameters.counted)
    ]
    without_effect = OF_FORCES if found.model.code == codes.STRAIGHT else ()
    missing = ("pulley_radius", "dead_cable") if found.before.winches is None else ()
    fixed = [name for name in observed if name not in (*found.parameters.names, *without_effect, *missing)]
    known = [name for name in fixed if name in found.before.tolerances]
    if known:
        yield from _wrapped(f"Not estimated, errors include the tolerance: {', '.join(known)}", width)
    exact = [name for name in fixed if name not in known]
    if exact:
        yield from _wrapped(f"Not estimated, taken as exact: {', '.join(exact)}", width)


def _values(found: Findings, width: int) -> Iterator[str]:
    """Lines with the estimated values, grouped by kind of parameter."""
    yield "Values ± standard errors:"
    numbers = found.parameters
    for name in dict.fromkeys(numbers.names):
        mine = [k for k, own in enumerate(numbers.names) if own == name]
        title = f"  {name}{_moved(found, mine)}"
        anchors = next((which for which in ANCHORS if which == name), None)
        if anchors is not None:
            yield title.replace(name, f"{name} [m]", 1)
            yield from _coordinates(found, anchors, width)
        elif len(mine) == 1:
            unit, before = numbers.units[mine[0]], numbers.prior[mine[0]]
            now = plus_minus(found.values[mine[0]], found.standard_error[mine[0]], unit)
            yield f"  {name}: {now}  (before {n(before, '.6g', unit)})"
        else:
            yield title
            yield from _in_columns([_cell(found, k) for k in mine], width)


def _moved(found: Findings, mine: list[int]) -> str:
    """Text of the largest change among the parameters `mine`, with the index of the cable."""
    numbers = found.parameters
    moved = np.abs(found.values[mine] - numbers.prior[mine])
    units = {numbers.units[k] for k in mine}
    if len(units) > 1 or not np.isfinite(moved).all():
        return ""
    most = mine[int(np.argmax(moved))]
    cable = int(numbers.cables[most])
    whose = f" (cable {cable})" if cable >= 0 else ""
    return f", moved by up to {n(moved.max(), '.3g', units.pop())}{whose}"


def _coordinates(found: Findings, name: Anchors, columns: int) -> Iterator[str]:
    """Lines with the coordinates of anchors, one anchor per line, and the errors of distances between anchors."""
    first = KINDS[name].first
    where = found.parameters.where[first : first + 3].T.astype(np.int64)
    anchors = getattr(found.robot, name)
    cells = [
        [
            plus_minus(found.values[k], found.standard_error[k], prefixed=False)
            if k >= 0
            else n(anchors[cable, axis], ".6g")
            for axis, k in enumerate(row)
        ]
        for cable, row in enumerate(where)
    ]
    widths = [max(len(row[axis]) for row in cells) for axis in range(3)]
    if sum(widths) + 15 > columns:
        yield from _in_columns([_cell(found, int(k)) for k in where.ravel() if k >= 0], columns)
        return
    yield "    cable  " + "  ".join(letter.rjust(width) for letter, width in zip("xyz", widths, strict=True))
    for cable, row in enumerate(cells):
        yield f"    {cable:5}  " + "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True))
    covariance = anchor_covariance(found.parameters, found.covariance, name)
    if covariance is not None:
        own = relative_covariance(anchors, covariance, name).reshape(where.size, where.size)
        seen = (found.standard_error < SEEN * found.parameters.prior_deviation)[where.ravel()]
        error = float(np.sqrt(np.diagonal(own)[seen].mean())) if seen.any() else np.inf
        if np.isfinite(error):
            yield f"    relative to one another ±{SPACE}{n(error, '.2g', 'm')} per coordinate"


def _cell(found: Findings, k: int) -> str:
    """Text of one value, with its cable or axis."""
    numbers = found.parameters
    _, _, axis = numbers.labels[k].partition(".")
    cable = int(numbers.cables[k])
    name = " ".join(([str(cable)] if cable >= 0 else []) + ([axis] if axis else []))
    return f"{name}{': ' if name else ''}{plus_minus(found.values[k], found.standard_error[k], numbers.units[k])}"


def _in_columns(cells: list[str], columns: int) -> Iterator[str]:
    """Lines with texts in columns, as many columns as fit in a line."""
    width = max(map(len, cells)) + 3
    each = max((columns - 4) // width, 1)
    for start in range(0, len(cells), each):
        yield ("    " + "".join(cell.ljust(width) for cell in cells[start : start + each])).rstrip()


def _directions(directions: Sequence[Direction], head: str, width: int) -> Iterator[str]:
    """Lines of directions, grouped by recommended measurement, with the remaining share of the prior error."""
    if not directions:
        return
    yield from _wrapped(head, width)
    by_step: dict[str, list[Direction]] = {}
    for direction in directions:
        by_step.setdefault(direction.step, []).append(direction)
    for step, same in by_step.items():
        yield from _wrapped(f"- {'; '.join(_together(same))}: {step}", width, "  ", "    ")


def _together(directions: Sequence[Direction]) -> Iterator[str]:
    """Names of directions with the remaining share of the prior error; names with equal beginnings are joined."""
    ends: dict[tuple[str, str], list[str]] = {}
    for one in directions:
        head, _, end = one.name.rpartition(" ")
        left = "" if one.known > 0.995 else f" ({100.0 * one.known:.0f}{SPACE}% of its prior error is left)"
        ends.setdefault((head, left), []).append(end)
    return (f"{head} {', '.join(own)}{left}".lstrip() for (head, left), own in ends.items())


def _outliers(found: Findings, width: int) -> Iterator[str]:
    """Lines of outliers, each with the position of the platform."""
    if not found.outliers:
        yield "Outliers: none"
        return
    place = {int(row): k for k, row in enumerate(found.rows)}
    less = (found.weights < 1.0).any()  # with robust=False, all poses have full weight
    yield f"Outliers, {len(found.outliers)}{'; their poses have less weight' if less else ''}:"
    single = list(found.outliers)
    for (quantity, cable), own in _faulty_sensors(found).items():
        single = [one for one in single if one not in own]
        size = n(float(np.median([one.size for one in own])), ".3g", UNITS[quantity])
        text = f"{quantity} {cable}, {len(own)} of {len(found.rows):,} rows: {size} off (median); check this sensor"
        yield from _wrapped(f"- {text}, its cable and its column", width, "  ", "    ")
    for outlier in single[:MOST_OUTLIERS]:
        at = ""
        if outlier.row in place:
            position = found.poses.position[place[outlier.row]]
            at = f", at ({', '.join(n(x, '.2f') for x in position)}) m".replace(" ", SPACE)
        yield from _wrapped(f"- {outlier_text(outlier)}{at}", width, "  ", "    ")
    if len(single) > MOST_OUTLIERS:
        yield f"  and {len(single) - MOST_OUTLIERS:,} more"


def _faulty_sensors(found: Findings) -> dict[tuple[str, int], list[Outlier]]:
    """Outliers of faulty sensors, which are length sensors or load cells with more outliers than chance explains."""
    groups: dict[tuple[str, int], list[Outlier]] = {}
    for one in found.outliers:
        if one.cable is not None:
            groups.setdefault((one.quantity, one.cable), []).append(one)
    share = 1.0 / (2 * found.robot.cable_count)  # expected share of the outliers, if all sensors are equal
    count = len(found.outliers)
    return {
        name: own for name, own in groups.items() if len(own) >= MANY and bdtrc(len(own) - 1, count, share) < CHANCE
    }


def _cross_validation(found: Findings, width: int) -> Iterator[str]:
    """Lines with the errors of predictions at poses that the calibration did not use."""
    check = found.cross_validation
    if check is None:
        return
    yield from _wrapped(f"At poses left out of the calibration, in {check.folds} folds (root mean square):", width)
    pairs = (("position", check.position_before, check.position, "m"),
             ("load cells", check.tension_before, check.tension, "N"))  # fmt: skip
    for name, before, after, unit in pairs:
        if np.isfinite(after):
            was = f", before {n(before, '.3g', unit)}" if np.isfinite(before) else ""
            yield f"  {name}: {n(after, '.3g', unit)}{was}"


def _wrapped(text: str, width: int, indent: str = "", further: str = "") -> list[str]:
    """Lines of a sentence that is wrapped at `width` characters."""
    return wrap(text, width, initial_indent=indent, subsequent_indent=further or indent + "  ", break_on_hyphens=False)


Anchors = Literal["frame_anchors", "platform_anchors"]
_TURNS: Final = {"frame_anchors": (2,), "platform_anchors": (0, 1, 2)}  # axes of rotations that no reading observes


def anchor_covariance(parameters: Parameters, covariance: Array, which: Anchors) -> Array | None:
    """Covariance (m, 3, m, 3) of the frame or platform anchors [m^2]; None if no anchor coordinate is estimated."""
    first = KINDS[which].first
    numbers = parameters.where[first : first + 3].T.reshape(-1).astype(np.int64)
    if (numbers < 0).all():
        return None
    asked = numbers >= 0
    whole = np.zeros((numbers.size, numbers.size))
    whole[np.ix_(asked, asked)] = covariance[np.ix_(numbers[asked], numbers[asked])]
    m = numbers.size // 3
    return whole.reshape(m, 3, m, 3)


def without_motion(points: Array, which: Anchors) -> Array:
    """Matrix (3 m, 3 m) that removes the common rigid motion from small changes of anchors `points` (m, 3)."""
    # The matrix removes shifts and unobservable rotations: for frame anchors, the rotation about the vertical; for
    # platform anchors, all rotations, because the platform anchors define the platform frame. The method is an
    # S-transformation with equal weights of all anchors (Baarda 1973).
    m = len(points)
    ways = [np.tile(axis, m) for axis in np.eye(3)]
    ways += [np.cross(np.eye(3)[axis], points - points.mean(axis=0)).reshape(-1) for axis in _TURNS[which]]
    basis, size, _ = np.linalg.svd(np.stack(ways, axis=1), full_matrices=False)
    basis = basis[:, size > 1e-9 * size[0]]
    return np.asarray(np.eye(3 * m) - basis @ basis.T)


def relative_covariance(points: Array, covariance: Array, which: Anchors) -> Array:
    """Covariance (m, 3, m, 3) [m^2] of anchors after removal of their common motion; NaN for infinite variances."""
    if not np.isfinite(covariance).all():
        return np.full(covariance.shape, np.nan)
    kept, size = without_motion(points, which), points.size
    return np.asarray(kept @ covariance.reshape(size, size) @ kept.T).reshape(covariance.shape)
