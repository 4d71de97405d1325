"""The material of cables, and the attributes of cables that are made from other cables."""

import pickle
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

from sagline import Cable, Catenary, InvalidValueError, Robot, dump_robot, identify_cable, load_robot, without_cables
from sagline.article.explanations import PARAMETERS, Parameter, robot_with_errors
from sagline.cables.cable import ROPES
from sagline.viewer.snapshot import Settings
from tests.refusal import refused

FIELDS = ("linear_density", "axial_stiffness", "diameter", "expansion")
THICKNESS, GROWTH = np.linspace(0.003, 0.01, 8), np.linspace(-1.2e-5, 1.2e-5, 8)
THICK = Cable(np.linspace(0.05, 0.1, 8), 44e3, diameter=THICKNESS, expansion=GROWTH)


def test_fields_have_one_shape_and_unknown_fields_are_none() -> None:
    cable = Cable([0.05, 0.1], 44e3, expansion=-1.2e-5)
    assert cable.diameter is None
    assert cable.expansion is not None
    assert cable.expansion.tolist() == [-1.2e-5, -1.2e-5]
    assert list(cable.known()) == ["linear_density", "axial_stiffness", "expansion"]
    wide = Cable(0.05, 44e3, diameter=[0.003, 0.004])
    assert wide.linear_density.tolist() == [0.05, 0.05]
    with pytest.raises(ValueError, match="read-only"):
        wide.linear_density[0] = 1.0


def test_from_material_accepts_diameter_and_expansion() -> None:
    cable = Cable.from_material(0.067, 2e9, [22e-6, 11e-6], diameter=0.0065, expansion=1e-5)
    np.testing.assert_allclose(cable.axial_stiffness, [44e3, 22e3], rtol=1e-15)
    assert (cable.known()["diameter"].tolist(), cable.known()["expansion"].tolist()) == ([0.0065] * 2, [1e-5] * 2)
    assert Cable.from_material(0.067, 2e9, 22e-6).diameter is None


@pytest.mark.parametrize(
    ("field", "value", "parts"),
    [
        ("linear_density", -1.0, ("linear_density", "-1 kg/m", ">= 0 kg/m, finite")),
        ("axial_stiffness", 0.0, ("axial_stiffness", "0 N", "> 0 N, finite")),
        ("diameter", 0.0, ("diameter", "0 m", "> 0 m, finite")),
        ("diameter", [0.004, -0.004], ("diameter[1]", "-0.004 m", "> 0 m, finite")),
        ("diameter", [0.004, np.nan], ("diameter[1]", "nan m", "> 0 m, finite")),
        ("diameter", "4 mm", ("diameter", "'4 mm'", "numbers")),
        ("expansion", np.inf, ("expansion", "inf 1/K", "finite")),
        ("expansion", {}, ("expansion", "{}", "numbers")),
        ("expansion", [1e-5, 1e-5, 1e-5], (" and ".join(FIELDS), "not of one shape, but (2,) and (3,)")),
    ],
)
def test_impossible_values_are_refused(field: str, value: Any, parts: tuple[str, ...]) -> None:
    good = Cable([0.1, 0.2], 1e4, diameter=0.004, expansion=0.0)
    with refused(*parts, kind=InvalidValueError):
        good.replace(**{field: value})
    with refused(*parts, kind=InvalidValueError):
        Cable(**{**good.known(), field: value})


def test_replace_does_not_change_the_original() -> None:
    stiff = THICK.replace(axial_stiffness=50e3, expansion=None)
    assert stiff.axial_stiffness.tolist() == [50e3] * 8
    assert stiff.expansion is None
    assert THICK.axial_stiffness.tolist() == [44e3] * 8
    np.testing.assert_array_equal(stiff.known()["diameter"], THICKNESS)
    with refused("field", "'thickness'", ", ".join(FIELDS), kind=InvalidValueError):
        THICK.replace(thickness=1.0)


def changed(parameter: Parameter, robot: Robot) -> Robot:
    return robot_with_errors(robot, {parameter.name: parameter.typical})


def saved_and_loaded(robot: Robot) -> Robot:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "robot.yaml"
        file.write_text(dump_robot(robot), encoding="utf-8")
        return load_robot(file)


PROTOTYPE = load_robot("article-prototype").replace(cables=THICK)
# all ways to make cables from others, with the indices of the remaining ones
WAYS: dict[str, Callable[[Robot], Robot]] = {
    "a file": saved_and_loaded,
    "a pickle": lambda robot: pickle.loads(pickle.dumps(robot)),
    "the viewer's sliders": Settings(mass=50.0, density=1.5, stiffness=0.5).applied,
    "broken cables": lambda robot: without_cables(robot, 3),
    **{f"another {parameter.name}": partial(changed, parameter) for parameter in PARAMETERS},
}


@pytest.mark.parametrize("way", WAYS)
def test_a_derived_cable_has_the_same_diameter(way: str) -> None:
    cables, kept = WAYS[way](PROTOTYPE).cables, [0, 1, 2, 4, 5, 6, 7] if way == "broken cables" else list(range(8))
    np.testing.assert_array_equal(cables.known()["diameter"], THICKNESS[kept])
    np.testing.assert_array_equal(cables.known()["expansion"], GROWTH[kept])


def test_part_of_a_batch() -> None:
    batch = Catenary().from_tension(THICK, 10.0, -4.0, 500.0)
    assert batch[3].cable.known()["diameter"] == THICKNESS[3]
    np.testing.assert_array_equal(batch[2:5].cable.known()["expansion"], GROWTH[2:5])
    bare = Catenary().from_tension(THICK.replace(diameter=None), 10.0, -4.0, 500.0)
    assert bare[3].cable.diameter is None


def test_a_rope_has_a_diameter() -> None:
    for rope in ROPES.values():
        assert rope.cable(0.006).diameter == 0.006
        assert rope.cable(0.006).expansion is None


def test_an_identified_cable_has_the_diameter_of_the_initial_one() -> None:
    rope, spans, tensions = Cable(0.067, 44e3, diameter=0.0065), np.array([8.0, 10.0, 12.0]), [50.0, 150.0, 300.0]
    length = Catenary().from_tension(rope, spans, -2.0, np.array(tensions)).unstrained_length
    start = rope.replace(linear_density=0.05, axial_stiffness=5e4)
    fit = identify_cable(spans, np.full(3, -2.0), length, tensions, tension_at="chord", start=start)
    assert fit.cable.diameter == 0.0065
    np.testing.assert_allclose(fit.cable.linear_density, 0.067, rtol=1e-4)
