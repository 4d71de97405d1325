"""Plan files with flipped bits, holes, cuts and foreign bytes: an error or the same plan, never other numbers."""

from functools import partial
from pathlib import Path

import pytest

import sagline as sl
from tests.abuse.damage import DAMAGES, Damage, errors_after_damage
from tests.files.plans import a_plan, assert_same
from tests.tiers import wide


@pytest.fixture(scope="module")
def plan() -> sl.Plan:
    return a_plan()


@pytest.fixture(scope="module")
def content(plan: sl.Plan, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    file = tmp_path_factory.mktemp("plan") / "run.nc"
    plan.save(file)
    return file.read_bytes()


@pytest.mark.parametrize("count", [30, pytest.param(2000, marks=pytest.mark.soak)])
@pytest.mark.parametrize("damage", wide(DAMAGES), ids=lambda damage: damage.__name__)
def test_damage_does_not_change_a_value_silently(
    plan: sl.Plan, content: bytes, tmp_path: Path, damage: Damage, count: int
) -> None:
    same = partial(assert_same, plan)
    assert errors_after_damage(damage, count, content, tmp_path / "run.nc", sl.load_plan, same) == []
