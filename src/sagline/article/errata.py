"""The eleven errata of the article, each with a computation: 1 to 4 platform, 5 to 9 cable, 10 and 11 misprints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import SupportsFloat, TypeAlias

import numpy as np

import sagline as sl
from sagline.article import regressions as fits
from sagline.article.drawing import chapter, finding
from sagline.article.simulation import METHOD, ROBOTS
from sagline.article.ten_poses import Table2
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.present.page import Chapter, Finding, Table

POSE = (2.0, 1.0, 1.5)  # position of the platform [m], not in a plane of symmetry of a simulated robot
PATH_RATE = 5.0  # samples per second; a low rate is sufficient because the errors change slowly
TAUT = 1e4  # tension [N] that is so large that only the leading terms matter


LONG = 15.0  # length of the simulated robots' frame [m]
TAUTER = 20.0  # factor that makes the sampled tensions so large that only the leading terms matter
NEARLY = 1e-6  # angle between a cable and the vertical or horizontal direction [rad]
TURN = (0.3, 0.2, 0.1)  # rotation angles [rad] about z, y, x

# label, value, unit; a difference also has the size of its terms, which shows if it is a rounding error
Number: TypeAlias = tuple[str, SupportsFloat, str] | tuple[str, SupportsFloat, str, float]


def _erratum(number: int, numbers: Sequence[Number]) -> Finding:
    """Finding about the erratum `number` of docs/errata.md, with the computed `numbers` as evidence."""
    rows = [(label, n(value, ".5g", unit, size=size[0] if size else 0.0)) for label, value, unit, *size in numbers]
    table = Table("Computed", ("quantity", "value"), rows)
    return finding(f"erratum-{number}", {label: float(value) for label, value, *_ in numbers}, data=(table,))


def _sign_of_intercept() -> Sequence[Number]:
    """Erratum 1: the line pi at the platform end has the intercept +wD/2; a wrong sign causes centimeters of error."""
    cable, chord = sl.load_robot(ROBOTS[0]).cables, 10.0
    angle = 0.754  # the article's angle [rad]
    state = sl.Catenary().from_tension(cable, chord * np.cos(angle), chord * np.sin(angle), TAUT, fits.GRAVITY)
    half_weight = 0.5 * cable.linear_density * fits.GRAVITY * chord / (1.0 + TAUT / cable.axial_stiffness)
    intercept = state.vertical_force - np.tan(angle) * state.horizontal_tension
    published = sl.Empirical()
    numbers: list[Number] = [
        ("b_π at the platform end divided by wD/2", (intercept / half_weight)[0], ""),
        ("b_π at the frame end divided by wD/2", ((intercept - state.cable_weight) / half_weight)[0], ""),
    ]
    for name in ROBOTS:
        for sign, model in (("right", published), ("printed", sl.Empirical(-published.k_h, published.k_p))):
            run = sl.confirm(sl.inverse(sl.load_robot(name), sl.article_path(PATH_RATE), model, METHOD))
            error = 1e3 * np.linalg.norm(run.position_error, axis=1)
            numbers.append((f"largest position error, {name}, {sign} sign", error.max(), "mm"))
    return numbers


def _gravity_twice() -> Sequence[Number]:
    """Erratum 2: gravity is counted twice, in equation (5) and again in (6) and (51)."""
    robot = sl.load_robot(ROBOTS[0])
    weight = robot.mass * robot.gravity
    numbers: list[Number] = [("weight of the platform", weight, "N")]
    for label, force in (
        ("gravity counted once", 0.0),
        ("as printed, g pointing down", -weight),
        ("as printed, g pointing up", weight),
    ):
        numbers.append((f"cables lift, {label}", _lifted(force), "N", weight))
    return numbers


def _euler_rates() -> Sequence[Number]:
    """Erratum 3: equation (5) has Euler-angle rates and a term M W x', unlike the Newton-Euler equations."""
    robot = sl.load_robot(ROBOTS[0])
    angles, rates, curvatures = np.array([0.4, 0.3, -0.2]), np.array([0.5, -0.6, 0.4]), np.array([0.3, 0.2, -0.5])
    still, velocity = np.zeros(3), np.array([1.0, 0.0, 0.0])
    spin, spin_rate = _angular(angles, rates, curvatures)
    inertia = sl.Pose.from_euler(still, *angles).matrix @ robot.inertia @ sl.Pose.from_euler(still, *angles).matrix.T
    right = inertia @ spin_rate + np.cross(spin, inertia @ spin)
    printed = inertia @ _reversed(curvatures) + np.cross(_reversed(rates), inertia @ _reversed(rates))
    at_rest, _ = _angular(angles, still, still)
    return (
        ("largest component of ω minus Euler rates", _largest(spin - _reversed(rates)), "rad/s"),
        ("largest component of ω̇ minus their rates", _largest(spin_rate - _reversed(curvatures)), "rad/s²"),
        ("error of the moment", np.linalg.norm(right - printed), "N m"),
        ("moment", np.linalg.norm(right), "N m"),
        (
            "force of M W ẋ at 1 m/s; the correct value is 0",
            robot.mass * np.linalg.norm(np.cross(_reversed(rates), velocity)),
            "N",
        ),
        ("the same errors at constant orientation", _largest(at_rest), "rad/s"),
    )


def _rank_of_h() -> Sequence[Number]:
    """Erratum 4: H^T H cannot be inverted."""
    robot = sl.load_robot(ROBOTS[0])
    balance = sl.article_balance(robot, sl.Pose(POSE))
    square, h = balance.h.T @ balance.h, balance.h
    singular = np.linalg.svd(square, compute_uv=False)
    tension = h.T @ np.linalg.solve(h @ h.T, -balance.b)
    return (
        ("rows of HᵀH", len(square), ""),
        ("rank of HᵀH", np.linalg.matrix_rank(square), ""),
        ("its smallest singular value divided by its largest", singular[-1] / singular[0], "", 1.0),
        ("condition of HHᵀ", np.linalg.cond(h @ h.T), ""),
        ("residual of Hᵀ(HHᵀ)⁻¹", np.abs(h @ tension + balance.b).max(), "N", float(np.abs(balance.b).max())),
    )


def _lifted(force: float) -> float:
    """Vertical force of all cables together [N], after (49) is solved for the vertical force `force` [N]."""
    robot = sl.load_robot(ROBOTS[0])
    pose = sl.Pose(POSE)
    balance = sl.article_balance(robot, pose)
    wanted = np.array([0.0, 0.0, force, 0.0, 0.0, 0.0])
    tension = balance.h.T @ np.linalg.solve(balance.h @ balance.h.T, wanted - balance.b)
    cables_alone = sl.article_balance(robot.replace(gravity=0.0), pose)  # equation (49) without weight
    return float((balance.h @ tension + cables_alone.b)[2])


def _angular(angles: Array, rates: Array, curvatures: Array) -> tuple[Array, Array]:
    """Angular velocity [rad/s] and angular acceleration [rad/s^2] in world axes, from Z-Y-X angles and derivatives."""
    (a, b, _), (da, db, dc), (dda, ddb, ddc) = angles, rates, curvatures
    sa, ca, sb, cb = np.sin(a), np.cos(a), np.sin(b), np.cos(b)
    spin = np.array([-sa * db + ca * cb * dc, ca * db + sa * cb * dc, da - sb * dc])
    rate = np.array(
        [
            -sa * ddb + ca * cb * ddc - ca * da * db - (sa * da * cb + ca * sb * db) * dc,
            ca * ddb + sa * cb * ddc - sa * da * db + (ca * da * cb - sa * sb * db) * dc,
            dda - sb * ddc - cb * db * dc,
        ]
    )
    return spin, rate


def _reversed(angles: Array) -> Array:
    """Vector x, y, z from angles about z, y, x, which is the order that makes the errors of (5) smallest."""
    return angles[::-1]


def _largest(vector: Array) -> float:
    return float(np.abs(vector).max())


def _stretch_by_end_tension() -> Sequence[Number]:
    """Erratum 5: equation (36) computes the elongation with the tension at B instead of the mean tension."""
    cable = fits.simulated_cable()
    stiff, soft, printed, right = fits.stretch_study(cable, fits.end_at_angle(LONG), np.array([500.0]))
    excess = float((printed - right)[0])
    length = LONG + float(soft.adjusting_length[0])
    formula = float(
        cable.linear_density * fits.GRAVITY * length**2 * np.sin(fits.ANGLE) / (2.0 * cable.axial_stiffness)
    )
    return (
        ("error of (36), simulation's cable at 15 m", 1e3 * excess, "mm"),
        ("the same divided by sin φ", 1e3 * excess / float(np.sin(fits.ANGLE)), "mm"),
        ("wL² sin φ/(2EA)", 1e3 * formula, "mm"),
        (
            "d minus d of the unstretchable cable, after removal of the stretch by the mean tension",
            1e3 * float((right - stiff.adjusting_length)[0]),
            "mm",
        ),
    )


def _sag_constant() -> Sequence[Number]:
    """Erratum 6: for cables with a small sag, k_p is g^2/24, not 4.385."""
    sampling = fits.article_sampling()
    taut = fits.SagStudy(sampling.between(*(TAUTER * sampling.tensions[[0, -1]])))
    return (
        ("g²/24", fits.SHALLOW_K_P, "m²/s⁴"),
        ("k_p by the article's regressions, taut cables", taut.k_p, "m²/s⁴"),
        ("increase of the sag term by the published value", 100.0 * (fits.PUBLISHED_K_P / fits.SHALLOW_K_P - 1.0), "%"),
    )


def _sign_in_bound() -> Sequence[Number]:
    """Erratum 7: the lower bound (54) of T_x has the wrong sign for a suspended cable."""
    from scipy.optimize import brentq

    cable, chord = fits.simulated_cable(), 10.0
    span, rise = fits.end_at_angle(chord) * np.array([1.0, -1.0])
    slope, intercept = rise / span, 0.5 * float(cable.linear_density) * fits.GRAVITY * chord

    def vertical(tension: float) -> float:
        return float(sl.Catenary().from_tension(cable, span, rise, tension * chord / span, fits.GRAVITY).vertical_force)

    turning = float(brentq(vertical, 0.1 * intercept, 10.0 * intercept))
    return (
        ("b_π/a_π", intercept / slope, "N"),
        ("|b_π/a_π|", abs(intercept / slope), "N"),
        ("T_x at which T_z = 0, exact cable", turning, "N"),
    )


def _vertical_and_level() -> Sequence[Number]:
    """Erratum 8: the equations fail for poses vertically below an anchor, and for poses with a horizontal cable."""
    robot = sl.load_robot(ROBOTS[0])
    under = robot.frame_anchors[0] - robot.platform_anchors[0] - [0.0, 0.0, 2.0]
    cable, chord = fits.simulated_cable(), 10.0
    half_weight = 0.5 * float(cable.linear_density) * fits.GRAVITY * chord
    vertical = sl.Catenary().from_tension(cable, 0.0, -chord, 100.0, fits.GRAVITY)
    level = sl.Catenary().from_tension(cable, chord, 0.0, 100.0, fits.GRAVITY)
    numbers: list[Number] = [("|tan φ| a microradian from vertical", abs(np.tan(0.5 * np.pi - NEARLY)), "")]
    for distance, label in ((1e-3, "1 mm"), (1e-6, "1 µm")):
        pose = sl.Pose(under + np.array([distance, 0.0, 0.0]))
        condition = float(np.linalg.cond(sl.article_balance(robot, pose).h))
        numbers.append((f"condition of H {label} from under an anchor", condition, ""))
        condition = float(np.linalg.cond(sl.structure_matrix(robot, pose)))
        numbers.append((f"condition of J {label} from under an anchor", condition, ""))
    numbers += [
        ("bound (54) a microradian from level", half_weight / float(np.tan(NEARLY)), "N"),
        ("length of the exact vertical cable of 10 m at 100 N", vertical.unstrained_length, "m"),
        ("length of the exact level cable of 10 m at 100 N", level.unstrained_length, "m"),
    ]
    return numbers


def _error_formula() -> Sequence[Number]:
    """Erratum 9: equation (56) is a sum of vectors B_i - P, but the errors in Table 2 are distances."""
    table, robot = Table2(), sl.load_robot("article-prototype")
    pairs = zip(table.desired, table.actual, strict=True)
    sums = np.array([(robot.platform_anchors + actual - desired).sum(axis=0) for desired, actual in pairs])
    literal = np.linalg.norm(sums, axis=1)
    return (
        (
            "largest difference of Table 2's errors from the distances",
            1e3 * float(np.abs(table.distance - table.printed_error).max()),
            "mm",
        ),
        (
            "largest difference of Table 2's errors from |Σ (B_i − P)|",
            1e3 * float(np.abs(literal - table.printed_error).max()),
            "mm",
        ),
    )


def _table_number() -> Sequence[Number]:
    """Erratum 10: the parameters of the robots are in Table 1, not in Table 2."""
    suspended, mixed = (sl.load_robot(name) for name in ROBOTS)
    same = (
        np.array_equal(suspended.cables.linear_density, mixed.cables.linear_density)
        and np.array_equal(suspended.cables.axial_stiffness, mixed.cables.axial_stiffness)
        and suspended.mass == mixed.mass
        and suspended.frame_size is not None
        and mixed.frame_size is not None
        and np.array_equal(suspended.frame_size, mixed.frame_size)
    )
    return (
        ("poses in Table 2", len(Table2().points), ""),
        ("cables of either robot", suspended.cable_count, ""),
        ("both robots agree in Table 1's parameters (1: yes)", same, ""),
    )


def _printed_formulas() -> Sequence[Number]:
    """Erratum 11: misprints in (31) and (8)."""
    slope, intercept = np.tan(0.754), 5.0
    horizontal = np.linspace(-100.0, 100.0, 2_000_001)
    least = float(np.hypot(horizontal, slope * horizontal + intercept).min())
    anchor, turned = sl.load_robot(ROBOTS[0]).platform_anchors[0], sl.Pose.from_euler((0.0, 0.0, 0.0), *TURN).matrix
    return (
        ("least |T| on a line π, by search", least, "N"),
        ("|b_π|/√(1 + a_π²)", intercept / np.hypot(1.0, slope), "N"),
        ("|b_π|/√(a_π² + b_π²), as printed", intercept / np.hypot(slope, intercept), "N"),
        (
            "error of an anchor by the transpose, at a rotation of (0.3, 0.2, 0.1) rad",
            1e3 * float(np.linalg.norm(turned.T @ anchor - turned @ anchor)),
            "mm",
        ),
    )


_NUMBERS = (
    *(_sign_of_intercept, _gravity_twice, _euler_rates, _rank_of_h, _stretch_by_end_tension, _sag_constant),
    *(_sign_in_bound, _vertical_and_level, _error_formula, _table_number, _printed_formulas),
)


def errata_chapter() -> Chapter:
    """Chapter of all errata with their numbers, in the order of docs/errata.md."""
    return chapter("errata", [_erratum(k, compute()) for k, compute in enumerate(_NUMBERS, 1)])
