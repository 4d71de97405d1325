"""Errata 1 to 4: the force balance of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

import sagline as sl
from sagline.article.sampling import GRAVITY
from sagline.article.simulation import METHOD, ROBOTS
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.present.page import Finding, Table, Verdict

POSE = (2.0, 1.0, 1.5)  # m: any pose of the simulated robots off their symmetry
PATH_RATE = 5.0  # samples per second: the errors change slowly
TAUT = 1e4  # N: a cable so taut that only the leading terms are left


# label, value, unit; the size of what it is a difference of, which tells rounding from a small number
Number: TypeAlias = tuple[str, float, str] | tuple[str, float, str, float]


def erratum(number: int, title: str, printed: str, right: str, numbers: Sequence[Number]) -> Finding:
    """Erratum of docs/errata.md: the printed text, what is right, and the numbers that show it."""
    rows = [(label, n(value, ".5g", unit, size=size[0] if size else 0.0)) for label, value, unit, *size in numbers]
    return Finding(
        key=f"erratum-{number}",
        title=f"erratum {number}: {title[0].lower() + title[1:]}",
        statement=printed,
        measured=right,
        verdict=Verdict.ERRATUM,
        numbers={label: value for label, value, *_ in numbers},
        data=(Table("Computed", ("quantity", "value"), rows),),
    )


def sign_of_intercept() -> Finding:
    """Erratum 1: the intercept of pi at the platform end is +wD/2, and the printed sign costs centimeters."""
    cable, chord = sl.load_robot(ROBOTS[0]).cables, 10.0
    angle = 0.754  # rad, the article's
    state = sl.Catenary().from_tension(cable, chord * np.cos(angle), chord * np.sin(angle), TAUT, GRAVITY)
    half_weight = 0.5 * cable.linear_density * GRAVITY * chord / (1.0 + TAUT / cable.axial_stiffness)
    intercept = state.vertical_force - np.tan(angle) * state.horizontal_tension
    published = sl.Empirical()
    numbers: list[Number] = [
        ("b_π at the platform end over wD/2", float((intercept / half_weight)[0]), ""),
        ("b_π at the frame end over wD/2", float(((intercept - state.cable_weight) / half_weight)[0]), ""),
    ]
    for name in ROBOTS:
        for sign, model in (("right", published), ("printed", sl.Empirical(-published.k_h, published.k_p))):
            run = sl.confirm(sl.inverse(sl.load_robot(name), sl.article_path(PATH_RATE), model, METHOD))
            error = 1e3 * np.linalg.norm(run.position_error, axis=1)
            numbers.append((f"largest position error, {name}, {sign} sign", float(error.max()), "mm"))
    return erratum(
        1,
        "Sign of the intercept b_π",
        "(28), (30): b_π = −ρgD/2.",
        "With the article's own (1) and (2), z up and T on the cable at B, the intercept is +ρgD/2; "
        "the printed sign is that of the frame end.",
        numbers,
    )


def gravity_twice() -> Finding:
    """Erratum 2: gravity in (5) and again in (6)/(51)."""
    robot = sl.load_robot(ROBOTS[0])
    weight = robot.mass * robot.gravity
    numbers: list[Number] = [("weight of the platform", weight, "N")]
    for label, force in (
        ("gravity counted once", 0.0),
        ("read literally, g pointing down", -weight),
        ("read literally, g pointing up", weight),
    ):
        numbers.append((f"cables lift, {label}", _lifted(force), "N", weight))
    return erratum(
        2,
        "Gravity counted twice",
        "(5) has Mg on its left side, and (6) and (51) have −mg on the other.",
        "Count it once. Read literally it cancels or doubles, by the direction given to g.",
        numbers,
    )


def euler_rates() -> Finding:
    """Erratum 3: (5) with Euler-angle rates, and its term M W x', against Newton and Euler."""
    robot = sl.load_robot(ROBOTS[0])
    angles, rates, curvatures = np.array([0.4, 0.3, -0.2]), np.array([0.5, -0.6, 0.4]), np.array([0.3, 0.2, -0.5])
    still, velocity = np.zeros(3), np.array([1.0, 0.0, 0.0])
    spin, spin_rate = _angular(angles, rates, curvatures)
    inertia = sl.Pose.from_euler(still, *angles).matrix @ robot.inertia @ sl.Pose.from_euler(still, *angles).matrix.T
    right = inertia @ spin_rate + np.cross(spin, inertia @ spin)
    printed = inertia @ _reversed(curvatures) + np.cross(_reversed(rates), inertia @ _reversed(rates))
    at_rest, _ = _angular(angles, still, still)
    return erratum(
        3,
        "Angular velocity from Euler-angle rates",
        "(5) takes the second derivative of (α, β, γ) as angular acceleration, and has a term M W ẋ.",
        "ω follows from the rates by a matrix of the angles, and a mass has no such term in a fixed frame. "
        "Both are right only for a constant orientation, which is the article's test.",
        (
            ("largest component of ω less Euler rates", _largest(spin - _reversed(rates)), "rad/s"),
            ("largest component of ω̇ less their rates", _largest(spin_rate - _reversed(curvatures)), "rad/s²"),
            ("error of the moment", float(np.linalg.norm(right - printed)), "N m"),
            ("moment", float(np.linalg.norm(right)), "N m"),
            (
                "force of M W ẋ at 1 m/s, where there is none",
                float(robot.mass * np.linalg.norm(np.cross(_reversed(rates), velocity))),
                "N",
            ),
            ("the same errors at constant orientation", _largest(at_rest), "rad/s"),
        ),
    )


def rank_of_h() -> Finding:
    """Erratum 4: H^T H cannot be inverted."""
    robot = sl.load_robot(ROBOTS[0])
    balance = sl.article_balance(robot, sl.Pose.from_euler(POSE, 0.0, 0.0, 0.0))
    square, h = balance.h.T @ balance.h, balance.h
    singular = np.linalg.svd(square, compute_uv=False)
    tension = h.T @ np.linalg.solve(h @ h.T, -balance.b)
    return erratum(
        4,
        "The inverse of HᵀH",
        "(52): t_x = (HᵀH)⁻¹Hᵀ{…}.",
        "H has 6 rows and 8 columns, so HᵀH is singular; the minimum norm is Hᵀ(HHᵀ)⁻¹{…}.",
        (
            ("rows of HᵀH", float(len(square)), ""),
            ("rank of HᵀH", float(np.linalg.matrix_rank(square)), ""),
            ("its smallest singular value over its largest", float(singular[-1] / singular[0]), "", 1.0),
            ("condition of HHᵀ", float(np.linalg.cond(h @ h.T)), ""),
            (
                "residual of Hᵀ(HHᵀ)⁻¹",
                float(np.abs(h @ tension + balance.b).max()),
                "N",
                float(np.abs(balance.b).max()),
            ),
        ),
    )


def _lifted(force: float) -> float:
    """Vertical force of all cables if (49) is solved for a resultant vertical force [N]."""
    robot = sl.load_robot(ROBOTS[0])
    pose = sl.Pose.from_euler(POSE, 0.0, 0.0, 0.0)
    balance = sl.article_balance(robot, pose)
    wanted = np.array([0.0, 0.0, force, 0.0, 0.0, 0.0])
    tension = balance.h.T @ np.linalg.solve(balance.h @ balance.h.T, wanted - balance.b)
    cables_alone = sl.article_balance(robot.replace(gravity=0.0), pose)  # b without the platform's weight
    return float((balance.h @ tension + cables_alone.b)[2])


def _angular(angles: Array, rates: Array, curvatures: Array) -> tuple[Array, Array]:
    """Angular velocity [rad/s] and acceleration [rad/s^2], world axes, of Z-Y-X angles and their derivatives."""
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
    """(alpha, beta, gamma) about z, y, x as a vector along x, y, z: the reading that favors the article."""
    return angles[::-1]


def _largest(vector: Array) -> float:
    return float(np.abs(vector).max())
