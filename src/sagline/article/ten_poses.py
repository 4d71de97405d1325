"""Study of Table 2 and figure 27: ten measured poses of the prototype, and possible causes of the errors."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from importlib.resources import files

import numpy as np

import sagline as sl
from sagline.article import explanations as causes
from sagline.article.regressions import fit_line
from sagline.core.arrays import Array, locked
from sagline.motion.rest_to_rest import QUINTIC


class Table2:
    """Table 2 of the article with the printed values."""

    def __init__(self) -> None:
        """Read the table from the package."""
        # source: Gia Luan & Truong Thinh 2020, Table 2
        text = files("sagline.article").joinpath("data/table2.csv").read_text(encoding="utf-8")
        rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))[1:]
        self.points, numbers = tuple(row[0] for row in rows), np.array([row[1:] for row in rows], dtype=np.float64)
        self.desired: Array = locked(numbers[:, 0:3].copy())  # desired positions [m], shape (10, 3)
        self.actual: Array = locked(numbers[:, 3:6].copy())  # measured positions [m], shape (10, 3)
        self.printed_error: Array = locked(1e-3 * numbers[:, 6])  # positioning errors as printed [m], shape (10,)

    @property
    def error(self) -> Array:
        """Actual minus desired position [m], shape (10, 3)."""
        return self.actual - self.desired

    @property
    def distance(self) -> Array:
        """Euclidean distance of actual and desired position [m], shape (10,)."""
        return np.asarray(np.linalg.norm(self.error, axis=1))


HOME = (0.0, 0.0, 1.5)  # home position of the prototype [m]
METHOD = sl.MinimumNorm("horizontal")
MOST = 3  # largest number of parameters that explain the errors together
TOUR_SPEED = 0.2  # assumed speed [m/s]; the article states "low speed"


class TenPoses:
    """The ten poses, their errors, and possible explanations of these errors."""

    def __init__(self) -> None:
        """Plan the prototype at the ten poses, and search for possible causes of the measured errors."""
        # The fits use exact cables and all sets of up to three parameters, within plausible limits. The remaining error
        # is at least 0.3 mm, because the printed positions are in whole millimeters.
        table, robot = Table2(), sl.load_robot("article-prototype")
        plan, home = _planned(robot, table.desired), _planned(robot, np.array([HOME]))

        def error_of(errors: Sequence[causes.Errors]) -> Array:
            return causes.rest_positions(robot, plan, home, errors) - table.desired

        # plan: plan of the prototype for the ten poses, with the empirical model
        # home: plan of the prototype for its home pose
        self.table, self.plan, self.home = table, plan, home
        typical = [{one.name: one.typical} for one in causes.PARAMETERS]
        # model_error: error of the empirical model at the ten poses [m], shape (10, 3)
        # dead_meter: actual minus desired positions that 1 m of dead length would cause [m], shape (10, 3)
        self.model_error, self.dead_meter, *off = error_of([{}, {causes.DEAD: 1.0}, *typical])
        # by parameter: actual minus desired positions that its typical error would cause [m], shape (10, 3)
        self.trends = {parameter.name: error for parameter, error in zip(causes.PARAMETERS, off, strict=True)}
        models = causes.subsets(causes.PARAMETERS, MOST)
        found = sorted(causes.explanations(error_of, table.error, models), key=lambda one: one.rms)
        # all explanations by one parameter, by two and by three parameters; each list is sorted by the remaining error
        self.explanations = [[one for one in found if len(one.parameters) == count + 1] for count in range(MOST)]
        # imitated: share of a pulley radius's effect that errors of length offset and anchor height together can
        # reproduce (ratio of vector norms)
        # single_zero: standard deviations of the length offsets of all cables [m], shape (m,)
        self.imitated, self.single_zero = _limits(robot, error_of, plan, self.best(2))
        # root mean square of the measured errors, over all coordinates [m]
        self.measured_rms = float(np.sqrt(np.mean(table.error**2)))

    def height_slope(self, error: Array) -> float:
        """Slope [mm/m] of a line that is fitted to the vertical `error` (10, 3) [m] over the height of the poses."""
        return float(fit_line(self.table.desired[:, 2], 1e3 * error[:, 2])[0])

    def best(self, count: int) -> causes.Explanation:
        """Explanation by `count` parameters that has the smallest remaining error."""
        return self.explanations[count - 1][0]

    def explanation(self, *names: str) -> causes.Explanation:
        """Explanation by the parameters that are named `names`."""
        return next(found for found in self.explanations[len(names) - 1] if found.names == set(names))


def tour(rate: float = 10.0) -> tuple[sl.Plan, Array]:
    """Path of the prototype from home through the ten poses and back, from rest to rest, without stops."""
    stops = [HOME, *Table2().desired, HOME]
    path = sl.quintic_path(stops, speed=TOUR_SPEED, rate=rate)
    plan = sl.inverse(sl.load_robot("article-prototype"), path, sl.Empirical(), METHOD)
    way = np.linalg.norm(np.diff(np.asarray(stops), axis=0), axis=1)
    return plan, locked(np.cumsum(way * QUINTIC.peak_speed / TOUR_SPEED)[:-1])


def _planned(robot: sl.Robot, positions: Array) -> sl.Plan:
    return sl.inverse(robot, sl.Pose(positions), sl.Empirical(), METHOD)


def _limits(robot: sl.Robot, error_of: causes.ErrorOf, plan: sl.Plan, found: causes.Explanation) -> tuple[float, Array]:
    """Values of `imitated` and `single_zero`, computed near the best explanation by two parameters."""
    at = dict(zip((p.name for p in found.parameters), found.values, strict=True))
    three = tuple(p for p in causes.PARAMETERS if p.name in (causes.PULLEY, causes.ZERO, causes.ANCHORS))
    ((_, slopes),) = causes.tangents(error_of, [three], [np.array([at.get(p.name, 0.0) for p in three])])
    is_pulley = np.array([p.name == causes.PULLEY for p in three])
    whole, others = slopes[:, is_pulley], slopes[:, ~is_pulley]
    imitation = others @ np.linalg.lstsq(others, whole)[0]
    state = sl.inverse(causes.robot_with_errors(robot, at), plan.state.pose, tension=METHOD).state
    by_zero = sl.stiffness(state).length_sensitivity[:, :3].reshape(-1, robot.cable_count)
    scatter = found.rms * np.sqrt(len(by_zero) / (len(by_zero) - robot.cable_count))
    imitated = float(np.linalg.norm(imitation) / np.linalg.norm(whole))
    return imitated, scatter * np.sqrt(np.diag(np.linalg.inv(by_zero.T @ by_zero)))
