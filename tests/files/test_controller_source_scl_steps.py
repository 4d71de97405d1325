"""SCL of the elastic cable (P3), not compiled here: its statements are executed in Python and compared."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array

CABLES = 4_000


def any_cables(rng: np.random.Generator) -> tuple[Array, ...]:
    """Span, rise, tension, weight and stiffness: all slopes including vertical ones, up to the limits of the block."""
    chord = 10.0 ** rng.uniform(-0.5, 1.5, CABLES)
    angle = rng.uniform(-np.pi / 2, np.pi / 2, CABLES)
    weight, stiffness = 10.0 ** rng.uniform(-2, 1, CABLES), 10.0 ** rng.uniform(3.5, 6.5, CABLES)
    slackness = 10.0 ** rng.uniform(-5, np.log10(1.999), CABLES)
    tension = np.minimum(weight * chord / (2 * slackness), 0.0999 * stiffness)
    span, rise = chord * np.cos(angle), chord * np.sin(angle)
    span[:100], rise[:100] = 0.0, np.where(rise[:100] < 0, -1.0, 1.0) * chord[:100]
    keep = weight * chord <= 1.999 * 2 * tension
    return tuple(x[keep] for x in (span, rise, tension, weight, stiffness))


def reference(cables: tuple[Array, ...]) -> sl.CableState:
    span, rise, tension, weight, stiffness = cables
    return sl.Catenary().from_tension(sl.Cable(weight, stiffness), span, rise, tension, gravity=1.0)


def as_python(scl: str) -> Callable[..., dict[str, Any]]:
    """The block as a function of its inputs; unknown statements are errors."""
    body = scl.partition("\nBEGIN\n")[2].partition("END_FUNCTION")[0]
    words = re.sub(r"//[^\n]*", "", body).replace("#", "")
    words = re.sub(r"\bSQRT\b", "sqrt", words)
    lines, depth = [], 1
    for statement in re.findall(r"\s*(IF\s.*?THEN|FOR\s.*?DO|[^;]+?;)", words, re.DOTALL):
        text = " ".join(statement.split()).rstrip(";").strip()
        if text.startswith("IF "):
            condition = text[3:-5].replace("NOT", "not").replace("AND", "and")
            lines.append("    " * depth + f"if {condition}:")
            depth += 1
        elif found := re.fullmatch(r"FOR (\w+) := (\w+) TO (\w+) DO", text):
            lines.append("    " * depth + f"for {found[1]} in range({found[2]}, {found[3]} + 1):")
            depth += 1
        elif text in ("END_IF", "END_FOR"):
            depth -= 1
        elif text == "RETURN":
            lines.append("    " * depth + "return locals()")
        else:
            target, expression = re.fullmatch(r"(\w+) := (.+)", text).groups()  # type: ignore[union-attr]
            lines.append("    " * depth + f"{target} = {expression}")
    scope: dict[str, Any] = {"sqrt": sqrt}
    head = "def block(Span, Rise, Tension, Weight, Stiffness):\n"
    exec(head + "\n".join([*lines, "    return locals()"]), scope)
    function: Callable[..., dict[str, Any]] = scope["block"]
    return function


@pytest.fixture(scope="module")
def text(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder: Path = tmp_path_factory.mktemp("scl")
    return sl.export_c(sl.load_robot("article-prototype"), folder / "sagline.c")[2].read_text()


def test_its_numbers_agree_with_the_kernels(text: str) -> None:
    block = as_python(text)
    cables = any_cables(np.random.default_rng(2))
    state = reference(cables)
    for k in range(0, len(cables[0]), 4):
        found = block(*(float(x[k]) for x in cables))
        assert found["SaglineLength"] == 0
        assert found["Length"] == pytest.approx(state.unstrained_length[k], rel=1e-14)
        assert abs(found["Vertical"] - state.vertical_force[k]) <= 1e-14 * state.platform_end_tension[k]


@pytest.mark.parametrize(
    ("tension", "status"), [(-1.0, 1), (0.0, 1), (0.5, 2), (0.89, 2), (0.91, 0), (1400.0, 0), (1500.0, 3)]
)
def test_unsupported_cables_have_a_status(text: str, tension: float, status: int) -> None:
    assert as_python(text)(4.0, 0.0, tension, 0.9, 14e3)["SaglineLength"] == status


def test_variables_are_declared_and_a_comment_says_that_it_is_not_compiled(text: str) -> None:
    head, _, body = text.partition("\nBEGIN\n")
    declared = set(re.findall(r"^\s+(\w+) : (?:LReal|Int);", head, re.MULTILINE))
    used = set(re.findall(r"#(\w+)", body)) - {"SaglineLength"}
    assert used == declared
    assert "NOT COMPILED" in head
    assert max(map(len, text.splitlines())) <= 120
