"""Damaged simulation files: an error or the same simulation, never other numbers."""

from functools import partial
from pathlib import Path

import pytest

import sagline as sl
from tests.abuse.damage import DAMAGES, Damage, errors_after_damage
from tests.files.simulations import a_simulation, assert_same
from tests.tiers import wide


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    file = tmp_path_factory.mktemp("simulation") / "sim.nc"
    a_simulation().save(file)
    return file.read_bytes()


@pytest.mark.parametrize("count", [10, pytest.param(2000, marks=pytest.mark.soak)])
@pytest.mark.parametrize("damage", wide(DAMAGES), ids=lambda damage: damage.__name__)
def test_damage_does_not_change_a_value_silently(content: bytes, tmp_path: Path, damage: Damage, count: int) -> None:
    same = partial(assert_same, a_simulation())
    assert errors_after_damage(damage, count, content, tmp_path / "sim.nc", sl.load_simulation, same) == []
