"""Data that tension distribution and sag forces exchange in iterations."""

import numpy as np

from sagline.kernels.cable.terms import new_cables
from sagline.kernels.inverse import poses
from sagline.kernels.statics import new_balance
from sagline.kernels.tension import polygon
from tests.kernels.compiled import from_python, memory
from tests.kernels.tension.problems import nearness, room_of

take_tensions = from_python(poses.take_tensions)
sag_force_change = from_python(poses.sag_force_change)
stay = from_python(poses.fix_reference)
reset_work_arrays = from_python(polygon.reset_work_arrays)
room_for_cables = from_python(new_cables)
room_for_balance = from_python(new_balance)


def test_cables_have_the_distributed_tensions_and_keep_their_sag_forces() -> None:
    cables, _ = room_for_cables(memory(), 3, False)
    balance, _ = room_for_balance(memory(), 3, 1)
    balance.tension[:], balance.scale[:] = [10.0, 24.0, 6.0], [1.0, 2.0, 0.5]
    cables.tau[:], cables.sag_force[:] = [10.0, 15.0, 12.0], [1.0, 2.0, 3.0]
    moved, largest = take_tensions(cables, balance)
    np.testing.assert_array_equal(cables.tau, [10.0, 12.0, 12.0])
    np.testing.assert_array_equal(cables.last_sag_force, [1.0, 2.0, 3.0])
    assert moved == 0.25
    assert largest == 12.0
    cables.sag_force[:] = [1.0, 1.5, 3.25]
    assert sag_force_change(cables) == 0.5


def test_held_bounds_are_stored_and_old_ones_discarded() -> None:
    balance, _ = room_for_balance(memory(), 5, 3)
    rng = np.random.default_rng(1)
    balance.null[:] = np.linalg.qr(rng.normal(size=(5, 2)))[0].T
    balance.tension[:] = rng.normal(size=5)
    near = nearness(2)
    near.held.labels[:2] = [1, 10]  # a sixth bound, that of tied sums
    stay(balance, near)
    np.testing.assert_allclose(near.reference, balance.null @ balance.tension, rtol=1e-14)
    assert near.held.labels[0] == 0


def test_a_new_pose_keeps_no_data_of_the_previous_one() -> None:
    kept = room_of(8, 2)
    kept.known[0], kept.basis.labels[0] = 4, 7
    reset_work_arrays(kept)
    assert kept.known[0] == 0
    assert kept.basis.labels[0] == -1
