"""Damaged calibration files: an error or the same calibration, never other numbers."""

from functools import partial
from pathlib import Path

import pytest

import sagline as sl
from tests.abuse.damage import DAMAGES, Damage, errors_after_damage
from tests.calibration.made_up import made_up
from tests.files.test_calibration_file import assert_same
from tests.tiers import wide


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    file = tmp_path_factory.mktemp("calibration") / "found.nc"
    made_up().save(file)
    return file.read_bytes()


@pytest.mark.parametrize("count", [10, pytest.param(1000, marks=pytest.mark.soak)])
@pytest.mark.parametrize("damage", wide(DAMAGES), ids=lambda damage: damage.__name__)
def test_damage_does_not_change_a_value_silently(content: bytes, tmp_path: Path, damage: Damage, count: int) -> None:
    same = partial(assert_same, made_up())
    assert errors_after_damage(damage, count, content, tmp_path / "found.nc", sl.load_calibration, same) == []
