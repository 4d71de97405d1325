"""The numbers of docs/calibration.md that no block of code prints."""

import re
from pathlib import Path

import numpy as np
import pytest
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline.calibration.observations import MachineTerms, predicted_rows
from sagline.calibration.parameters import parameters_of
from sagline.core.arrays import Array
from sagline.statics.tables import pose_rows
from tests.calibration.synthetic import USUAL, log_of, true_robot, with_drums
from tests.tiers import extended
from tools.pages.snippets import blocks

pytestmark = extended

ROOT = Path(__file__).parents[2]
PAGE = " ".join((ROOT / "docs" / "calibration.md").read_text(encoding="utf-8").split())
PLATFORM = ("frame_anchors", "platform_anchors", "length_zero", "linear_density", "axial_stiffness", "mass")
SENSORS = sl.Sensors(5e-4, 5.0)


def gauge_of(*unknowns: str, drums: bool = True) -> tuple[int, list[str]]:
    """Number of unknowns, and the directions that a log of encoders and load cells leaves unidentifiable."""
    nominal = with_drums() if drums else sl.load_robot("cogiro").replace(winches=sl.Winch(load_cell_gain=1.0))
    found = sl.calibrate(nominal, log_of(true_robot(nominal, USUAL, seed=1), 32, seed=2).log, unknowns, folds=0)
    return len(found.values), [way.name for way in found.gauge]


def test_11_directions_of_63_parameters_are_unidentifiable_and_one_is_the_scale() -> None:
    count, names = gauge_of(*PLATFORM, "center_of_mass", "drum_radius")
    assert (count, len(names)) == (63, 11)
    assert sum("scale" in name for name in names) == 1
    assert re.search(rf"\b{count} unknowns\b.*\b{len(names)} gauge directions\b", PAGE)


def test_a_known_center_of_mass_removes_the_shift_of_the_platform(snapshot: SnapshotAssertion) -> None:
    _, names = gauge_of(*PLATFORM)
    assert sum("platform" in name and "turned" in name for name in names) == 3
    assert not any("platform" in name and "shifted" in name for name in names)
    assert re.findall(r"[^.]*three shifts[^.]*\.", PAGE) == snapshot


def test_the_common_gain_of_load_cells_and_the_masses_are_unidentifiable(snapshot: SnapshotAssertion) -> None:
    heavy = ("length_zero", "load_cell_gain", "linear_density", "axial_stiffness")
    assert len(gauge_of(*heavy, "mass", drums=False)[1]) == 1
    assert gauge_of(*heavy, drums=False)[1] == []
    assert re.findall(r"[^.]*all gains[^.]*\.", PAGE) == snapshot


def slopes(unknowns: tuple[str, ...]) -> tuple[Array, tuple[str, ...]]:
    """Whitened slopes of the readings of the page over pulleys, with the parameter of each column."""
    drawn = sl.load_robot("cogiro").replace(winches=sl.Winch(pulley_radius=0.03))
    names: dict[str, object] = {}
    page = blocks((ROOT / "docs" / "calibration.md").read_text(encoding="utf-8"))
    code = next(block.text for block in page if block.kind == "python")
    exec(code.partition("\n\ndef read")[0], names)  # poses of the platform
    poses, ways = names["poses"], names["ways"]
    assert isinstance(poses, sl.Pose)
    assert isinstance(ways, list)
    numbers = parameters_of(drawn, unknowns, SENSORS, counted=False)
    rows = []
    for way in ways:
        plan = sl.inverse(drawn, poses[:20], tension=way)
        said = predicted_rows(
            MachineTerms(drawn, sl.Catenary(), numbers, SENSORS), pose_rows(poses[:20]), plan.unstrained_length
        )
        rows.append(said.matrix.reshape(-1, len(numbers.names)))
    return np.concatenate(rows), numbers.names


@pytest.mark.parametrize(
    ("by", "words"),
    [(("length_zero",), "zeros alone reproduces {} %"), (("length_zero", "frame_anchors"), "together reproduce {} %")],
)
def test_zeros_and_anchors_imitate_most_of_a_pulley(by: tuple[str, ...], words: str) -> None:
    matrix, names = slopes((*by, "pulley_radius"))
    own = np.array([name == "pulley_radius" for name in names])
    pulley, others = matrix[:, own][:, 0], matrix[:, ~own]
    left = pulley - others @ np.linalg.lstsq(others, pulley, rcond=1e-10)[0]
    share = 100.0 * (1.0 - np.linalg.norm(left) / np.linalg.norm(pulley))
    assert words.format(f"{share:.1f}") in PAGE
