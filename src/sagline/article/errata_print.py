"""Errata 9 to 11: slips of the printed text."""

from __future__ import annotations

import numpy as np

from sagline.article.erratum import Erratum, Quantity
from sagline.article.simulation import ROBOTS
from sagline.article.table2 import table2
from sagline.core.arrays import Array
from sagline.files.robot_file import load_robot
from sagline.robot.pose import Pose

TURN = (0.3, 0.2, 0.1)  # rad, about z, y, x


def error_formula() -> Erratum:
    """Erratum 9: (56) sums B_i - P; Table 2 has distances."""
    table, robot = table2(), load_robot("article-prototype")
    sums = np.array([(robot.platform_anchors + actual - desired).sum(axis=0) for desired, actual in _pairs()])
    literal = np.linalg.norm(sums, axis=1)
    return Erratum(
        9,
        "The error formula (56)",
        "(56): ξ = Σ B_i(t) − P(t).",
        "Table 2's errors are the Euclidean distances of desired and actual position.",
        (
            Quantity(
                "largest difference of Table 2's errors from the distances",
                1e3 * float(np.abs(table.distance - table.printed_error).max()),
                "mm",
            ),
            Quantity(
                "largest difference of Table 2's errors from |Σ (B_i − P)|",
                1e3 * float(np.abs(literal - table.printed_error).max()),
                "mm",
            ),
        ),
    )


def table_number() -> Erratum:
    """Erratum 10: the robots' parameters are in Table 1."""
    suspended, mixed = (load_robot(name) for name in ROBOTS)
    same = (
        np.array_equal(suspended.cables.linear_density, mixed.cables.linear_density)
        and np.array_equal(suspended.cables.axial_stiffness, mixed.cables.axial_stiffness)
        and suspended.mass == mixed.mass
        and suspended.frame_size is not None
        and mixed.frame_size is not None
        and np.array_equal(suspended.frame_size, mixed.frame_size)
    )
    return Erratum(
        10,
        "“Table 2” for Table 1",
        "Section 7: both robots have the same number of cables and related parameters, “as summarized in Table 2”.",
        "Those are in Table 1; Table 2 has the ten poses of the prototype.",
        (
            Quantity("poses in Table 2", float(len(table2().points)), ""),
            Quantity("cables of either robot", float(suspended.cable_count), ""),
            Quantity("both robots agree in Table 1's parameters (1: yes)", float(same), ""),
        ),
    )


def printed_formulas() -> Erratum:
    """Erratum 11: (31) and (8)."""
    slope, intercept = np.tan(0.754), 5.0
    horizontal = np.linspace(-100.0, 100.0, 2_000_001)
    least = float(np.hypot(horizontal, slope * horizontal + intercept).min())
    anchor, turned = load_robot(ROBOTS[0]).platform_anchors[0], Pose.from_euler((0.0, 0.0, 0.0), *TURN).matrix
    return Erratum(
        11,
        "Slips in (31) and (8)",
        "(31): T_min = |b_π|/√(a_π² + b_π²). (8): b_i = (R)ᵀ b_i.",
        "The least |T| on π is |b_π|/√(1 + a_π²), and R of (9) already leads from the platform to the world.",
        (
            Quantity("least |T| on a line π, by search", least, "N"),
            Quantity("|b_π|/√(1 + a_π²)", float(intercept / np.hypot(1.0, slope)), "N"),
            Quantity("|b_π|/√(a_π² + b_π²), as printed", float(intercept / np.hypot(slope, intercept)), "N"),
            Quantity(
                "anchor misplaced by the transpose, turned by (0.3, 0.2, 0.1) rad",
                1e3 * float(np.linalg.norm(turned.T @ anchor - turned @ anchor)),
                "mm",
            ),
        ),
    )


def _pairs() -> list[tuple[Array, Array]]:
    table = table2()
    return list(zip(table.desired, table.actual, strict=True))
