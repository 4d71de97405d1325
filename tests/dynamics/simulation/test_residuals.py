"""Residual vibration after motions of all kinds: the table of docs/howto/without-vibration.md, by simulation."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.dynamics.residuals import HEAVY, WAYS, planned, residual, scene
from tests.tiers import extended

PAGE = Path(__file__).parents[3] / "docs" / "howto" / "without-vibration.md"


def rows() -> dict[str, list[str]]:
    """Table of the page with its numbers."""
    found = re.findall(
        r"^\| ((?:static|plan)[^|]*) \|((?: [0-9.]+ \|)+)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE
    )
    return {name: cells.replace("|", " ").split() for name, cells in found}


def test_the_page_has_all_kinds_of_motion() -> None:
    assert list(rows()) == list(WAYS)


@extended
@pytest.mark.parametrize("name", WAYS)
def test_the_page_has_the_residual_vibration(name: str) -> None:
    found = planned(name)[0].duration, residual(name), residual(name, HEAVY), residual(name, cable_mass="lumped")
    for number, cell in zip(found, rows()[name], strict=True):  # to the digits on the page
        assert f"{number:.{len(cell.partition('.')[2])}f}" == cell


@extended
def test_the_page_has_the_residual_vibration_of_interpolated_lengths() -> None:
    told = f"causes a residual of {1e3 * residual('plan'):.2f} micrometers at {1000:,} samples per second"
    assert told in " ".join(PAGE.read_text(encoding="utf-8").split())


def test_residuals_agree_with_another_program() -> None:
    """Tagged reference: an independent Runge-Kutta integration of the same robot in numpy, exact catenaries, 2 ms."""
    assert scene().frequency == pytest.approx([2.74601, 1.84399], abs=2e-5)
    known = {"": (5.9538, 2e-3), ", ZV": (2.1310, 1e-3), ", ZVD": (1.0429, 1e-3), ", EI": (0.9206, 1e-3)}
    for shaper, (value, tolerance) in (known | {", ZV of both": (0.4100, 1e-3)}).items():
        assert residual(f"static lengths{shaper}") == pytest.approx(value, abs=tolerance)
    assert residual("plan") < 1e-3
    assert residual("static lengths", HEAVY) == pytest.approx(10.425, abs=5e-3)
    assert residual("plan", HEAVY) == pytest.approx(1.4160, abs=2e-3)
    assert residual("plan, ZVD", HEAVY) == pytest.approx(0.1754, abs=1e-3)


@extended
def test_with_cable_mass_a_shaped_plan_leaves_half_a_millimeter_or_less() -> None:
    """An independent integration of lumped cables gives 7.8 mm for static lengths, 2.4 mm for the plan."""
    assert residual("static lengths", cable_mass="lumped") == pytest.approx(7.8, abs=0.15)
    assert residual("plan", cable_mass="lumped") == pytest.approx(2.4, abs=0.05)
    for name, most in (("plan, ZVD of both", 0.5), ("plan, ZVD of both with cable mass", 0.2)):
        assert residual(name, cable_mass="lumped") < most
