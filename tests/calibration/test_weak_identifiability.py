"""Weakly identifiable parameters: compared with covariances of normal equations, and machines with a known result."""

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

import sagline as sl
from sagline.calibration.findings import Direction
from sagline.calibration.identifiability import append_rows, gauge_of
from sagline.calibration.observations import MachineTerms, predicted_rows
from sagline.calibration.parameters import Parameters, PriorUnits
from sagline.calibration.weak_identifiability import weak_directions
from sagline.core.arrays import Array
from tests.calibration import reference
from tests.calibration.machines import standing
from tests.calibration.reference import pose_rows
from tests.tiers import extended, wide


class Identified(NamedTuple):
    """Unknowns, their covariance without the gauge in units of the priors, and the weakly identifiable ones."""

    parameters: Parameters
    scatter: Array
    found: tuple[Direction, ...]


@cache
def identified(robot: str, unknowns: tuple[str, ...], *, positions: bool = False) -> Identified:
    machine, pose, lengths = standing(sl.load_robot(robot), 40)
    sensors = sl.Sensors(5e-4, 5.0, 1e-3 if positions else None)
    shared = tuple(name for name in unknowns if name in ("pulley_radius", "axial_stiffness", "linear_density"))
    parameters = reference.parameters(machine, unknowns, shared=shared)
    matrix = predicted_rows(
        MachineTerms(machine.robot, sl.Catenary(), parameters, sensors), pose_rows(pose), lengths
    ).matrix
    triangle = append_rows(np.zeros((0, len(parameters.names))), matrix)
    gauge = gauge_of(triangle, parameters, parameters.prior, machine.robot, sensors)
    rows = matrix.reshape(-1, matrix.shape[2]) * PriorUnits(parameters).scale
    left = np.array([one.vector for one in gauge]).reshape(len(gauge), rows.shape[1]) / PriorUnits(parameters).units
    basis = np.linalg.qr(left.T)[0]
    outside = np.eye(rows.shape[1]) - basis @ basis.T
    scatter: Array = outside @ np.linalg.inv(rows.T @ rows + np.eye(rows.shape[1])) @ outside
    return Identified(parameters, scatter, weak_directions(triangle, parameters, gauge))


@extended
def test_a_pulley_and_the_height_of_anchors() -> None:
    seen = identified("ipanema-2-pulleys", ("frame_anchors", "length_zero", "pulley_radius"), positions=True).found
    assert [one.name.split(" with ") for one in seen] == [["pulley_radius", "frame_anchors z"]]
    assert "caliper" in seen[0].step


@extended
def test_a_pulley_and_zeros() -> None:
    seen = identified(
        "ipanema-2-pulleys", ("length_zero", "pulley_radius", "axial_stiffness", "mass", "center_of_mass")
    ).found
    assert [one.name.split(" with ") for one in seen] == [["pulley_radius", "length_zero"]]


def test_densities_of_ropes_and_mass_of_the_platform() -> None:
    seen = identified("cogiro", ("length_zero", "linear_density", "mass")).found
    assert [one.name.split(" with ") for one in seen] == [["linear_density", "mass"]]
    assert "weigh" in seen[0].step


@pytest.mark.parametrize(
    ("robot", "unknowns"),
    wide(
        [
            ("cogiro", ("frame_anchors", "length_zero", "axial_stiffness", "mass", "center_of_mass")),
            (
                "cogiro",
                ("frame_anchors", "platform_anchors", "length_zero", "linear_density", "mass", "center_of_mass"),
            ),
            ("article-suspended", ("length_zero", "axial_stiffness", "linear_density", "mass")),
            ("ipanema-2-pulleys", ("frame_anchors", "length_zero", "pulley_radius")),
        ],
        first=3,
    ),
)
def test_remaining_share_of_the_prior(robot: str, unknowns: tuple[str, ...]) -> None:
    parameters, scatter, found = identified(robot, unknowns)
    units = PriorUnits(parameters).units
    for one in found:
        vector = one.vector / units
        np.testing.assert_allclose(np.linalg.norm(vector), one.known, rtol=1e-9)
        unit = vector / one.known
        np.testing.assert_allclose(np.sqrt(unit @ scatter @ unit), one.known, rtol=1e-4)


@pytest.mark.parametrize("robot", ["cogiro", "article-suspended"])
def test_every_strong_correlation_is_named(robot: str) -> None:
    unknowns = ("platform_anchors", "length_zero", "axial_stiffness", "mass", "center_of_mass")
    parameters, scatter, found = identified(robot, unknowns)
    size = np.sqrt(np.diag(scatter))
    strong = np.argwhere(np.triu(np.abs(scatter / np.outer(size, size)), 1) > 0.98)
    kinds = {(parameters.labels[i].partition("[")[0], parameters.labels[j].partition("[")[0]) for i, j in strong}
    named = {tuple(part.partition("[")[0] for part in one.name.split(" with ")) for one in found if "[" in one.name}
    assert kinds <= named | {(other, one) for one, other in named if (one, other) in named}


def test_no_parameter_is_weakly_identifiable_if_all_is_measured() -> None:
    assert identified("cogiro", ("length_zero", "mass"), positions=True).found == ()
