"""The chapter of figures 8 to 15: its numbers compared with textbook catenaries, its sentences with its numbers."""

import re

import numpy as np
import pytest

from sagline.article.constants import sag_chapter
from sagline.article.regressions import published_sampling
from sagline.core.arrays import Array
from sagline.present.page import Finding
from tests.article.hanging import GRAVITY, length_and_force
from tests.tiers import extended

pytestmark = extended


@pytest.fixture(scope="module")
def findings() -> dict[str, Finding]:
    return {finding.key: finding for finding in sag_chapter().findings}


def factor(shape: Array, values: Array) -> float:
    """Slope of least squares, by the solver of NumPy."""
    return float(np.linalg.lstsq(shape[:, None], values)[0][0])


def numbers_of_sentence(finding: Finding) -> list[str]:
    """Numbers of a sentence in order, except numbers of equations and errata."""
    text = re.sub(r"\(\d+\)|erratum \d+|/24|\(24 ", "", finding.measured).replace("−", "-")
    return re.findall(r"(?<![\w.])-?\d+(?:\.\d+)?", text)


def test_the_regressions_by_hand_give_the_numbers(findings: dict[str, Finding]) -> None:
    sampling = published_sampling()
    angles, chords, densities, tensions = sampling.angles, sampling.chords, sampling.densities, sampling.tensions
    a_d = np.empty((5, 8, 10))
    shares = np.empty((5, 8, 10, 60))
    for a, c, r in np.ndindex(a_d.shape):
        span, rise = (np.full(60, chords[c] * part(angles[a])) for part in (np.cos, np.sin))
        d = length_and_force(span, rise, np.full(60, densities[r]), tensions)[0] - chords[c]
        a_d[a, c, r] = factor(1.0 / tensions**2, d)
        shares[a, c, r] = d * tensions**2 / a_d[a, c, r]
    q_a = np.array([[factor(chords**3, a_d[a, :, r]) for r in range(10)] for a in range(5)])
    p_q = np.array([factor(np.cos(angles) ** 4, q_a[:, r]) for r in range(10)])
    cubic = np.abs(q_a[:, None] * chords[:, None] ** 3 - a_d).max(axis=1) / a_d.max(axis=1)
    fourth = np.abs(p_q * np.cos(angles)[:, None] ** 4 - q_a).max(axis=0) / q_a.max(axis=0)
    numbers = {key: finding.numbers for key, finding in findings.items()}
    assert numbers["d-model"]["exact_over_fit_min"] == pytest.approx(shares.min(), rel=1e-4)
    assert numbers["d-model"]["exact_over_fit_max"] == pytest.approx(shares.max(), rel=1e-4)
    assert numbers["a-over-chord"]["cubic_away_share"] == pytest.approx(cubic.max(), rel=1e-5)
    assert numbers["q-over-angle"]["cos4_away_share"] == pytest.approx(fourth.max(), rel=1e-5)
    assert numbers["p-over-density"]["k_p"] == pytest.approx(factor(densities**2, p_q), rel=1e-7)
    assert numbers["p-over-density"]["k_p_of_density"] == pytest.approx(p_q / densities**2, rel=1e-6)


def test_the_stretched_cable_by_hand(findings: dict[str, Finding]) -> None:
    """Hooke's law at 500 N, on the textbook catenary of the cable of Table 1."""
    numbers = findings["d-over-tension"].numbers
    span, rise = np.array([10.0 * np.cos(0.754)]), np.array([10.0 * np.sin(0.754)])
    length, vertical = (float(x[0]) for x in length_and_force(span, rise, np.array([0.067]), np.array([500.0])))
    end, middle = (np.hypot(500.0, vertical - part * 0.067 * GRAVITY * length) for part in (0.0, 0.5))
    assert numbers["least_unstretchable_m"] == pytest.approx(length - 10.0, rel=1e-6)
    assert numbers["last_stretchable_m"] == pytest.approx(length / (1.0 + middle / 44e3) - 10.0, rel=1e-3)
    assert numbers["share_of_hooke"] == pytest.approx(-numbers["last_stretchable_m"] * 44e3 / (10.0 * end), rel=1e-9)
    assert findings["stretch-removed"].numbers["error_of_36_mm"] == pytest.approx(0.51, abs=0.01)


def test_the_sentences_contain_the_numbers(findings: dict[str, Finding]) -> None:
    numbers = {key: finding.numbers for key, finding in findings.items()}
    stretch, relieved = numbers["d-over-tension"], numbers["stretch-removed"]
    ratio, density = numbers["d-model"], numbers["p-over-density"]
    each = density["k_p_of_density"]
    cubic, fourth = numbers["a-over-chord"]["cubic_away_share"], numbers["q-over-angle"]["cos4_away_share"]
    sentences = {
        "d-over-tension": [
            f"{1e6 * stretch['least_unstretchable_m']:.0f}",  # µm
            f"{1e3 * stretch['last_stretchable_m']:.0f}",
            f"{stretch['share_of_hooke']:.3f}",
        ],
        "stretch-removed": [
            f"{relieved['error_of_36_mm']:.2f}",
            f"{1e3 * relieved['error_with_mean_tension_mm']:.0f}",  # µm
        ],
        "d-model": [f"{ratio['exact_over_fit_min']:.3f}", f"{ratio['exact_over_fit_max']:.3f}"],
        "a-over-chord": [f"{100.0 * cubic:.1f}"],
        "q-over-angle": [f"{100.0 * fourth:.1f}"],
        "p-over-density": [
            f"{density['k_p']:.4f}",
            f"{each[0]:.3f}",
            f"{GRAVITY**2 / 24.0:.3f}",
            f"{each[-1]:.3f}",
        ],
    }
    assert {key: numbers_of_sentence(finding) for key, finding in findings.items()} == sentences
