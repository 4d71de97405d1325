"""The exact cable compared with 90-digit arithmetic in every row, including extreme cables."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from sagline import Cable, CableStatus, Catenary
from tests.cables.reference import Reference, load_reference

LIMIT = 4e-15  # relative to the length or to the larger end tension


@pytest.fixture(scope="module")
def reference() -> Reference:
    table = load_reference()
    assert len(table.group) == 630
    return table


def test_from_length_reaches_the_last_digits_on_every_row(reference: Reference) -> None:
    state = Catenary().from_length(reference.cable, reference.span, reference.rise, reference.p2_length)
    error = np.hypot(
        state.horizontal_tension - reference.p2_horizontal, state.vertical_force - reference.p2_vertical
    ) / reference.largest_tension(reference.p2_horizontal, reference.p2_vertical, reference.p2_length)
    worst = int(np.argmax(error))
    assert error[worst] < LIMIT, (reference.group[worst], worst)


def test_from_tension_reaches_the_last_digits_on_every_row(reference: Reference) -> None:
    rows = reference.span > 0.0
    span, rise = reference.span[rows], reference.rise[rows]
    cable = Cable(reference.cable.linear_density[rows], reference.cable.axial_stiffness[rows])
    horizontal = reference.p3_horizontal[rows]
    state = Catenary().from_tension(cable, span, rise, horizontal * (np.hypot(span, rise) / span))
    length_error = np.abs(state.unstrained_length / reference.p3_length[rows] - 1.0)
    largest = reference.largest_tension(reference.p3_horizontal, reference.p3_vertical, reference.p3_length)[rows]
    force_error = np.abs(state.vertical_force - reference.p3_vertical[rows]) / largest
    assert length_error.max() < LIMIT
    assert force_error.max() < LIMIT
    assert np.all(state.status == CableStatus.SOLVED)


def folded_rows(reference: Reference) -> NDArray[np.bool_]:
    """Vertical cables with a slack part: longer than the height, by less than the stretch due to their weight."""
    kappa = 0.5 * reference.weight * reference.p2_length / reference.cable.axial_stiffness
    return np.asarray(reference.span == 0.0) & (np.abs(reference.rise) < reference.p2_length * (1.0 + kappa))


def test_vertical_taut_cables_are_recovered_from_their_tension(reference: Reference) -> None:
    rows = (reference.span == 0.0) & ~folded_rows(reference)
    assert rows.sum() == 8
    cable = Cable(reference.cable.linear_density[rows], reference.cable.axial_stiffness[rows])
    rise, length = reference.rise[rows], reference.p2_length[rows]
    tension = Catenary().from_length(cable, 0.0, rise, length).chord_tension
    state = Catenary().from_tension(cable, 0.0, rise, tension)
    np.testing.assert_allclose(state.unstrained_length, length, rtol=LIMIT)
    np.testing.assert_allclose(state.vertical_force, reference.p2_vertical[rows], rtol=1e-11)


def test_folded_cables_are_slack_and_all_others_solved(reference: Reference) -> None:
    state = Catenary().from_length(reference.cable, reference.span, reference.rise, reference.p2_length)
    folded = folded_rows(reference)
    assert folded.sum() == 12
    assert np.all(state.status[folded] == CableStatus.SLACK)
    assert np.all(state.status[~folded] == CableStatus.SOLVED)


def test_closure_of_every_row_is_rounding(reference: Reference) -> None:
    state = Catenary().from_length(reference.cable, reference.span, reference.rise, reference.p2_length)
    # a rounding error of the force changes the profile by its compliance, one of the length by itself
    scale = np.maximum(reference.p2_length, np.hypot(reference.span, reference.rise))
    assert np.max(state.closure_residual / scale) < 1e-13
