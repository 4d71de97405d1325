"""Numbers of docs/model.md on cables with mass in time, computed again."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np

import sagline as sl
from sagline.dynamics.simulation.chain_equilibrium import chains_at_rest
from tests.dynamics.simulation.test_chains import cogiro, moved
from tests.tiers import extended

pytestmark = extended
PAGE = Path(__file__).parents[2] / "docs" / "model.md"


@cache
def page() -> str:
    """The page in one line."""
    return " ".join(PAGE.read_text(encoding="utf-8").split())


def test_how_far_off_a_chain_of_twenty_elements_rests() -> None:
    off = chains_at_rest(cogiro(), 20)[0].position - cogiro().pose.position
    assert f"For CoGiRo with 20 elements the difference is {1e6 * np.linalg.norm(off):.1f} µm." in page()


def test_error_of_the_energy_balance_along_a_path() -> None:
    energy = moved().energy
    turned_over, error = np.ptp(energy.supplied), np.abs(energy.error).max()
    told = f"the winches supply and take back {turned_over:,.0f} J. The residual of the energy balance is"
    assert f"{told} ${1e6 * error:.0f} \\cdot 10^{{-6}}$ J" in page()


def test_agreement_of_steps_after_a_break() -> None:
    """At 0.45, 0.2 and 0.1 of l sqrt(rho/EA), of which the default is 0.4, 5e-5 s."""
    after = []
    for share in (1.125, 0.5, 0.25):
        run = sl.simulate(cogiro(), cable_mass="lumped", duration=0.5, step=share * 5e-5, events=sl.Break(0, 0.0))
        after.append(run.events[0].tension_after)
    off = max(abs(one / after[-1] - 1.0) for one in after)
    found = re.search(r"0\.45 \\, h_0\$, \$0\.2 \\, h_0\$ and \$0\.1 \\, h_0\$ agree to (\S+) %", page())
    assert found is not None
    assert found[1] == f"{100 * off:.2f}"
