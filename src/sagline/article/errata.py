"""Errata 5 to 11, the single cable and slips of the printed text, and the chapter of all eleven."""

from __future__ import annotations

import numpy as np

import sagline as sl
from sagline.article.errata_platform import Number, erratum, euler_rates, gravity_twice, rank_of_h, sign_of_intercept
from sagline.article.feasible_sets import End
from sagline.article.regressions import PUBLISHED_K_P, SHALLOW_K_P, sag_study, stretch_study
from sagline.article.sampling import ANGLE, GRAVITY, article_sampling, simulated_cable
from sagline.article.simulation import ROBOTS
from sagline.article.table2 import table2
from sagline.core.arrays import Array
from sagline.present.page import Chapter, Finding

LONG = 15.0  # m, the simulated frame
TAUT = 20.0  # times the sampled tensions: so that only the leading terms are left
NEARLY = 1e-6  # rad from vertical or level
TURN = (0.3, 0.2, 0.1)  # rad, about z, y, x


def stretch_by_end_tension() -> Finding:
    """Erratum 5: the elongation of (36) is that of the tension at B, not of the mean."""
    cable = simulated_cable()
    end = End.at_angle(LONG)
    study = stretch_study(cable, end, np.array([500.0]))
    excess = float((study.relieved - study.relieved_exactly)[0])
    length = end.chord + float(study.stretchable[0])
    formula = float(cable.linear_density * GRAVITY * length**2 * np.sin(ANGLE) / (2.0 * cable.axial_stiffness))
    return erratum(
        5,
        "Stretch by the tension at one end",
        "(35), (36): the elongation is |T|L/EA with T at the platform end.",
        "By (2) it is that of the mean tension, so the length is off by wL² sin φ/(2EA).",
        (
            ("error of (36), simulation's cable at 15 m", 1e3 * excess, "mm"),
            ("the same over sin φ", 1e3 * excess / float(np.sin(ANGLE)), "mm"),
            ("wL² sin φ/(2EA)", 1e3 * formula, "mm"),
            (
                "left of d after the mean tension is taken out, against the unstretchable cable",
                1e3 * float((study.relieved_exactly - study.unstretchable)[0]),
                "mm",
            ),
        ),
    )


def sag_constant() -> Finding:
    """Erratum 6: k_p of shallow cables is g^2/24."""
    sampling = article_sampling()
    taut = sag_study(sampling.between(*(TAUT * sampling.tensions[[0, -1]])))
    return erratum(
        6,
        "The sag constant k_p",
        "(45): k_p = 4.385, “we cannot exactly formulate k_p due to the errors in the established model”.",
        "For shallow cables it is g²/24; the regression is biased by the lowest tensions it samples.",
        (
            ("g²/24", SHALLOW_K_P, "m²/s⁴"),
            ("k_p by the article's regressions, taut cables", taut.k_p, "m²/s⁴"),
            ("what the published value adds to the sag term", 100.0 * (PUBLISHED_K_P / SHALLOW_K_P - 1.0), "%"),
        ),
    )


def sign_in_bound() -> Finding:
    """Erratum 7: the bound (54) on T_x of a suspended cable."""
    from scipy.optimize import brentq

    cable, chord = simulated_cable(), 10.0
    span, rise = End.at_angle(chord) * np.array([1.0, -1.0])
    slope, intercept = rise / span, 0.5 * float(cable.linear_density) * GRAVITY * chord

    def vertical(tension: float) -> float:
        return float(sl.Catenary().from_tension(cable, span, rise, tension * chord / span, GRAVITY).vertical_force)

    turning = float(brentq(vertical, 0.1 * intercept, 10.0 * intercept))
    return erratum(
        7,
        "Sign in the lower bound (54)",
        "(54): T_x > b_π/a_π + T_adj.",
        "For a suspended cable a_π < 0 and b_π > 0, so that b_π/a_π is negative and bounds nothing. The lowest point "
        "leaves the span where T_z = 0, at T_x = +|b_π/a_π|.",
        (
            ("b_π/a_π", intercept / slope, "N"),
            ("|b_π/a_π|", abs(intercept / slope), "N"),
            ("T_x at which T_z = 0, exact cable", turning, "N"),
        ),
    )


def vertical_and_level() -> Finding:
    """Erratum 8: no pose under an anchor, and none with a level cable."""
    robot = sl.load_robot(ROBOTS[0])
    under = robot.frame_anchors[0] - robot.platform_anchors[0] - [0.0, 0.0, 2.0]
    cable, chord = simulated_cable(), 10.0
    half_weight = 0.5 * float(cable.linear_density) * GRAVITY * chord
    vertical = sl.Catenary().from_tension(cable, 0.0, -chord, 100.0, GRAVITY)
    level = sl.Catenary().from_tension(cable, chord, 0.0, 100.0, GRAVITY)
    numbers: list[Number] = [("|tan φ| a microradian from vertical", float(abs(np.tan(0.5 * np.pi - NEARLY))), "")]
    for distance, label in ((1e-3, "1 mm"), (1e-6, "1 µm")):
        pose = sl.Pose.from_euler(under + np.array([distance, 0.0, 0.0]), 0.0, 0.0, 0.0)
        condition = float(np.linalg.cond(sl.article_balance(robot, pose).h))
        numbers.append((f"condition of H {label} from under an anchor", condition, ""))
        condition = float(np.linalg.cond(sl.structure_matrix(robot, pose)))
        numbers.append((f"condition of J {label} from under an anchor", condition, ""))
    numbers += [
        ("bound (54) a microradian from level", half_weight / float(np.tan(NEARLY)), "N"),
        ("length of the exact vertical cable of 10 m at 100 N", float(vertical.unstrained_length), "m"),
        ("length of the exact level cable of 10 m at 100 N", float(level.unstrained_length), "m"),
    ]
    return erratum(
        8,
        "Vertical and level cables",
        "(26), (50): the slope of π is tan φ. (54): T_x is bounded by |b_π/tan φ|.",
        "tan φ is infinite under an anchor, and the bound is infinite for a level cable, so that no pose with one is "
        "admissible. In the chord tension τ = T_x/cos φ both are ordinary.",
        numbers,
    )


def error_formula() -> Finding:
    """Erratum 9: (56) sums B_i - P; Table 2 has distances."""
    table, robot = table2(), sl.load_robot("article-prototype")
    sums = np.array([(robot.platform_anchors + actual - desired).sum(axis=0) for desired, actual in _pairs()])
    literal = np.linalg.norm(sums, axis=1)
    return erratum(
        9,
        "The error formula (56)",
        "(56): ξ = Σ B_i(t) − P(t).",
        "Table 2's errors are the Euclidean distances of desired and actual position.",
        (
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
        ),
    )


def table_number() -> Finding:
    """Erratum 10: the robots' parameters are in Table 1."""
    suspended, mixed = (sl.load_robot(name) for name in ROBOTS)
    same = (
        np.array_equal(suspended.cables.linear_density, mixed.cables.linear_density)
        and np.array_equal(suspended.cables.axial_stiffness, mixed.cables.axial_stiffness)
        and suspended.mass == mixed.mass
        and suspended.frame_size is not None
        and mixed.frame_size is not None
        and np.array_equal(suspended.frame_size, mixed.frame_size)
    )
    return erratum(
        10,
        "“Table 2” for Table 1",
        "Section 7: both robots have the same number of cables and related parameters, “as summarized in Table 2”.",
        "Those are in Table 1; Table 2 has the ten poses of the prototype.",
        (
            ("poses in Table 2", float(len(table2().points)), ""),
            ("cables of either robot", float(suspended.cable_count), ""),
            ("both robots agree in Table 1's parameters (1: yes)", float(same), ""),
        ),
    )


def printed_formulas() -> Finding:
    """Erratum 11: (31) and (8)."""
    slope, intercept = np.tan(0.754), 5.0
    horizontal = np.linspace(-100.0, 100.0, 2_000_001)
    least = float(np.hypot(horizontal, slope * horizontal + intercept).min())
    anchor, turned = sl.load_robot(ROBOTS[0]).platform_anchors[0], sl.Pose.from_euler((0.0, 0.0, 0.0), *TURN).matrix
    return erratum(
        11,
        "Slips in (31) and (8)",
        "(31): T_min = |b_π|/√(a_π² + b_π²). (8): b_i = (R)ᵀ b_i.",
        "The least |T| on π is |b_π|/√(1 + a_π²), and R of (9) already leads from the platform to the world.",
        (
            ("least |T| on a line π, by search", least, "N"),
            ("|b_π|/√(1 + a_π²)", float(intercept / np.hypot(1.0, slope)), "N"),
            ("|b_π|/√(a_π² + b_π²), as printed", float(intercept / np.hypot(slope, intercept)), "N"),
            (
                "anchor misplaced by the transpose, turned by (0.3, 0.2, 0.1) rad",
                1e3 * float(np.linalg.norm(turned.T @ anchor - turned @ anchor)),
                "mm",
            ),
        ),
    )


def _pairs() -> list[tuple[Array, Array]]:
    table = table2()
    return list(zip(table.desired, table.actual, strict=True))


DEMONSTRATIONS = (
    sign_of_intercept,
    gravity_twice,
    euler_rates,
    rank_of_h,
    stretch_by_end_tension,
    sag_constant,
    sign_in_bound,
    vertical_and_level,
    error_formula,
    table_number,
    printed_formulas,
)


def errata_chapter() -> Chapter:
    """Each erratum with its demonstration, in the order of docs/errata.md."""
    return Chapter(
        "errata",
        "Errata",
        "Eleven slips in the article, each shown by a computation. None touches its idea; with them mended its closed "
        "form is good to a few millimeters.",
        tuple(demonstrate() for demonstrate in DEMONSTRATIONS),
    )
