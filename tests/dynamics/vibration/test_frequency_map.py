"""Maps of frequencies: poses compared with single computations, and contents of files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sagline as sl
from tests.refusal import refused
from tests.tiers import wide

ROBOT = sl.load_robot("cogiro")
POSES = sl.Pose.from_euler(
    [[0, 0, 2], [3, 2, 2], [-4, 1, 1], [0, 0, 50], *np.random.default_rng(3).uniform([-3, -2, 1], [3, 2, 3], (16, 3))],
    0, 0, 0,
)  # fmt: skip


@pytest.fixture(scope="module")
def found() -> sl.FrequencyMap:
    told: list[tuple[int, int]] = []
    made = sl.frequency_map(ROBOT, POSES, up_to=8.0, progress=lambda done, count: told.append((done, count)))
    assert told == [(16, 20), (20, 20)]
    return made


def test_poses_agree_with_single_computations(found: sl.FrequencyMap) -> None:
    for k in (0, 1, 2, 17):
        alone = sl.vibration(sl.inverse(ROBOT, POSES[k]).state, up_to=8.0)
        assert found.status[k] == sl.VibrationStatus.SOLVED
        assert found.frequency[k] == pytest.approx(alone.frequency[0], rel=1e-9)
        assert found.massless_frequency[k] == pytest.approx(alone.massless_frequency[0], rel=1e-9)
        assert found.platform_share[k] == pytest.approx(alone.platform_share[0], abs=1e-7)


@pytest.mark.parametrize(
    "damping",
    wide(
        [
            sl.Damping(loss_time=1e-3),  # couples modes: a sum over them has 1.17 times the peak beside it
            sl.Damping(modal_damping=0.01),
            sl.Damping(air_damping=0.02),
            sl.Damping(3e-4, 0.003, 0.005),
        ]
    ),
)
def test_the_largest_response_agrees_with_frequency_response(damping: sl.Damping) -> None:
    some = POSES[np.array([0, 1, 2, 17])]
    found = sl.frequency_map(ROBOT, some, up_to=8.0, damping=damping)
    for k in range(4):
        close = found.peak_frequency[k] + np.linspace(-0.02, 0.02, 401)
        frequency = np.union1d(np.linspace(0.5, 8.0, 751), close)
        response = sl.frequency_response(sl.inverse(ROBOT, some[k]).state, frequency, damping)
        norms = np.linalg.norm(response.compliance[:, :3, :3], 2, axis=(1, 2))
        assert found.peak[k] == pytest.approx(norms.max(), rel=1e-3)
        assert found.peak_frequency[k] == pytest.approx(frequency[np.argmax(norms)], abs=2e-4)


def test_a_pose_without_a_response_is_marked(found: sl.FrequencyMap) -> None:
    assert found.status[3] == sl.VibrationStatus.NO_LENGTHS
    for name in ("frequency", "massless_frequency", "platform_share", "peak", "peak_frequency"):
        assert np.flatnonzero(np.isnan(getattr(found, name))).tolist() == [3]


def test_without_low_modes_the_static_response_is_the_largest() -> None:
    few = sl.frequency_map(ROBOT, POSES[:1], up_to=0.5)
    static = sl.stiffness(sl.inverse(ROBOT, POSES[0]).state).compliance[:3, :3]
    assert np.isnan(few.frequency[0])
    assert few.peak[0] == pytest.approx(np.linalg.norm(static, 2))
    assert few.peak_frequency[0] == 0.0


@pytest.mark.parametrize("damping", [None, sl.Damping()])
def test_undamped_peaks_are_infinite(damping: sl.Damping | None) -> None:
    assert np.isinf(sl.frequency_map(ROBOT, POSES[:1], up_to=8.0, damping=damping).peak[0])


def test_its_file_has_units_and_the_robot(found: sl.FrequencyMap, tmp_path: Path) -> None:
    import xarray

    found.save(tmp_path / "map.nc")
    with xarray.open_dataset(tmp_path / "map.nc", engine="h5netcdf") as data:
        assert data["frequency"].attrs["units"] == "Hz"
        assert "cable mass" in data["frequency"].attrs["long_name"]
        assert "massless" in data["massless_frequency"].attrs["long_name"]
        assert data["peak"].attrs["units"] == "m/N"
        assert data["frequency"].values == pytest.approx(found.frequency, nan_ok=True)
        assert data["position"].values == pytest.approx(POSES.position)
        assert data["status"].values.tolist() == found.status.tolist()
        assert data["status"].attrs["flag_meanings"].split() == [status.name.lower() for status in sl.VibrationStatus]
        assert data.attrs["modal_damping"] == 0.01
        (tmp_path / "robot.yaml").write_text(str(data.attrs["robot"]), encoding="utf-8")
    assert sl.load_robot(tmp_path / "robot.yaml").mass == ROBOT.mass


def test_poses_are_a_batch() -> None:
    with refused("poses", "a single pose"):
        sl.frequency_map(ROBOT, POSES[0], up_to=8.0)


def test_too_many_modes_name_the_pose() -> None:
    with refused("pose 0: up_to"):
        sl.frequency_map(ROBOT, POSES[:2], up_to=900.0)
