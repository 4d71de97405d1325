"""Data of the machine between encoder and cable."""

import pickle
from typing import Any, NamedTuple

import attrs
import numpy as np
import pytest

from sagline import Cable, InvalidValueError, Robot, Winch, load_robot, without_cables
from sagline.robot.batch import cables_of
from tests.refusal import refused

# fields with a number for each cable
RULES = {
    field.name: field for field in attrs.fields(Winch) if field.name not in ("swivel_axis", "on_platform", "guides")
}
# required in addition to a value of 2 or 3 for every field
BESIDE: dict[str, dict[str, float]] = {"dead_rise": {"dead_cable": 5.0}}
# values that a field refuses
NEVER_NEGATIVE = (
    *("pulley_radius", "pulley_friction", "rolling_friction", "dead_cable", "drum_radius", "drum_width"),
    *(
        "groove_pitch",
        "layers",
        "drum_distance",
        "counts_per_turn",
        "length_zero",
        "cable_length",
        "winding_tension",
        "inertia",
    ),
    *("torque_limit", "speed_limit", "friction", "position_gain", "speed_gain", "integral_gain"),
    *("load_cell_range", "load_cell_deviation", "load_cell_gain"),
)
NEVER_ZERO = (
    *("drum_radius", "drum_width", "groove_pitch", "layers", "drum_distance", "gear", "counts_per_turn"),
    *("length_zero", "cable_length", "inertia", "torque_limit", "speed_limit", "load_cell_range", "load_cell_gain"),
)
UNKNOWN = (
    *("drum_radius", "drum_width", "groove_pitch", "drum_distance", "counts_per_turn", "length_zero"),
    *("cable_length", "inertia", "torque_limit", "speed_limit", "position_gain", "speed_gain", "integral_gain"),
    "load_cell_range",
)
ONE_OR_8 = "one value, or 8, one per cable"
NOTHING = object()


def fields_of(winch: Winch) -> dict[str, Any]:
    return {name: getattr(winch, name) for name in Winch.__slots__}


def assert_same(winch: Winch, other: Winch) -> None:
    for name, field in fields_of(winch).items():
        np.testing.assert_array_equal(getattr(other, name), field, err_msg=name)


def test_a_winch_without_data_is_an_eyelet_with_counted_turns() -> None:
    found = {name: field for name, field in fields_of(Winch()).items() if field is not None}
    assert set(RULES) - set(found) == set(UNKNOWN)
    assert {name for name, field in found.items() if field.ndim == 0 and field == 1.0} == {
        "layers",
        "gear",
        "load_cell_gain",
    }
    assert found.pop("swivel_axis").tolist() == [0.0, 0.0, 1.0]
    assert found.pop("on_platform").tolist() is False
    assert all(field in (0.0, 1.0) for field in found.values())


@pytest.mark.parametrize("name", [name for name in RULES if name != "rolling_friction"])
def test_every_field_has_the_given_value(name: str) -> None:
    beside: dict[str, Any] = BESIDE.get(name, {})
    assert getattr(Winch(**beside, **{name: 2}), name).tolist() == 2.0
    several = Winch(**beside, **{name: [2, 3, 2]})
    assert getattr(several, name).tolist() == [2.0, 3.0, 2.0]
    assert several.shape == (3,)
    assert several.swivel_axis.tolist() == [[0.0, 0.0, 1.0]] * 3
    for field in several.known().values():
        assert field.shape[:1] == (3,)
        assert not field.flags.writeable


class Case(NamedTuple):
    """A field, a refused value, and parts of the error: value, beginning of the range, element."""

    name: str
    value: Any
    shown: str
    allowed: str = ""
    element: str = ""


def cases() -> list[Case]:
    found: list[Case] = []
    for name, rule in RULES.items():
        unit = f" {rule.metadata['unit']}".rstrip()
        found += [
            Case(name, np.nan, f"nan{unit}", "finite"),
            Case(name, [2.0, np.inf, 2.0], f"inf{unit}", "finite", "[1]"),
            Case(name, [2.0, 1e300], f"1e+300{unit}", element="[1]"),
            Case(name, "fast", "'fast'", "numbers"),
            Case(name, 1j, "complex: 1j", "numbers"),
            Case(name, [[2.0, 2.0]], "of shape (1, 2)", "shape () or (m,)"),
            Case(name, [], "of shape (0,)", "shape () or (m,)"),
            Case(name, NOTHING, repr(NOTHING), "numbers"),
        ]
        if name in NEVER_NEGATIVE:
            found += [Case(name, -1.0, f"-1{unit}", ">"), Case(name, [2, -1e-9], f"-1e-09{unit}", ">", "[1]")]
        if name in NEVER_ZERO:
            above = "not 0" if name == "gear" else ">"
            found += [Case(name, 0.0, f"0{unit}", above), Case(name, [2.0, 0.0], f"0{unit}", above, "[1]")]
        if name not in UNKNOWN:
            found.append(Case(name, None, "None", "numbers"))
    found += [Case("layers", [1.0, 2.0, 1.5], "1.5", "whole numbers", "[2]"), Case("layers", 0.5, "0.5")]
    found += [Case("layers", 100000, "100000", "1 to 1000"), Case("layers", [1.0, 2e3], "2000", "1 to 1000", "[1]")]
    found += [Case("pulley_radius", [0.1, 50.0], "50 m", "0 to 10 m", "[1]")]
    axis = "swivel_axis"
    return [
        *found,
        Case("on_platform", 2, "2", "true or false"),
        Case("on_platform", [True, -1], "-1", "true or false", "[1]"),
        Case("on_platform", [0.0, np.nan], "nan", "finite", "[1]"),
        Case("on_platform", "up", "'up'", "numbers"),
        Case("on_platform", [[True, False]], "of shape (1, 2)", "shape () or (m,)"),
        Case("on_platform", None, "None", "numbers"),
        Case(axis, [0, 0, 0], "the zero vector", "a direction"),
        Case(axis, [[0, 0, 1], [0, 0, 0]], "the zero vector", "a direction", "[1]"),
        Case(axis, [0, 1], "of shape (2,)"),
        Case(axis, 1.0, "of shape ()"),
        Case(axis, [0, 0, np.nan], "nan", element="[2]"),
        Case(axis, [[[0, 0, 1]]], "of shape (1, 1)"),
        Case(axis, None, "None"),
    ]


@pytest.mark.parametrize(
    "case", cases(), ids=lambda case: f"{case.name}{case.element}-{case.shown.partition(' at ')[0]}"
)
def test_impossible_values_are_refused_by_name(case: Case) -> None:
    with refused(f"winches: {case.name}{case.element}", case.shown, kind=InvalidValueError) as found:
        Winch(**{**BESIDE.get(case.name, {}), case.name: case.value})
    allowed = found.value.allowed
    assert allowed.startswith(case.allowed) or (case.allowed == "finite" and allowed.endswith("finite"))
    text = str(found.value)
    assert len(text) < 300
    assert "\n" not in text
    assert found.value.next_step
    assert case.allowed != "up or down" or "[0, 0, -1]" in found.value.next_step


@pytest.mark.parametrize("name", [name for name in RULES if name != "pulley_radius"])
def test_seven_of_eight_rows_are_named(name: str) -> None:
    with refused(f"winches: {name}", "7 values", "one value, or 8, as pulley_radius has", kind=InvalidValueError):
        Winch([0.05] * 8, **{name: [2.0] * 7})


def test_the_longest_field_determines_the_size() -> None:
    with refused("winches: pulley_radius", "7 values", "one value, or 8, as gear has", kind=InvalidValueError):
        Winch([0.05] * 7, gear=[1.0] * 8)
    with refused("winches: swivel_axis", "2 values", "one value, or 3, as pulley_radius has", kind=InvalidValueError):
        Winch([0.05] * 3, swivel_axis=[[0, 0, 1]] * 2)
    with refused("winches: swivel_axis", "3 values", "one value, or 8, one per cable", kind=InvalidValueError):
        COGIRO.replace(winches=Winch(0.05, swivel_axis=[[1, 0, 0]] * 3))
    assert Winch([0.05], gear=[1.0, 2.0]).pulley_radius.tolist() == [0.05, 0.05]


def test_the_rise_of_a_dead_length_is_at_most_its_length() -> None:
    assert Winch(dead_cable=[2.0, 3.0], dead_rise=[-2.0, 3.0]).dead_rise.tolist() == [-2.0, 3.0]
    with refused("winches: dead_rise[1]", "-3.1 m", "within +-3 m, its dead_cable", kind=InvalidValueError):
        Winch(dead_cable=3.0, dead_rise=[3.0, -3.1])


def test_dead_length_is_at_least_the_straight_distance() -> None:
    assert Winch(dead_cable=[2.0, 3.0], cable_length=3.0).dead_cable.tolist() == [2.0, 3.0]
    with refused("winches: cable_length[1]", "2.9 m", ">= 3 m, its dead_cable", kind=InvalidValueError):
        Winch(dead_cable=[2.0, 3.0], cable_length=2.9)


@pytest.mark.parametrize("name", RULES)
def test_the_field_with_too_few_values_for_a_robot_is_named(name: str) -> None:
    beside: dict[str, Any] = BESIDE.get(name, {})
    other: dict[str, Any] = {"inertia" if name == "pulley_radius" else "pulley_radius": 0.05}
    two, three = (0.2, 0.3) if name == "rolling_friction" else (2, 3)
    with refused(f"winches: {name}", "7 values", ONE_OR_8, kind=InvalidValueError):
        COGIRO.replace(winches=Winch(**beside, **other, **{name: [two, three, two, three, two, three, two]}))
    with refused("winches", "7 values", ONE_OR_8, kind=InvalidValueError):
        COGIRO.replace(winches=Winch(**beside, **other, **{name: [two] * 7}))  # the cable is unknown


def test_a_block_of_seven_winches_is_named_in_one_line() -> None:
    seven: dict[str, Any] = {name: [2, 3, 2, 3, 2, 3, 2] for name in RULES}
    for name in ("dead_rise", "dead_cable", "rolling_friction"):
        del seven[name]
    item = "winches: pulley_radius, swivel_axis, pulley_friction, ..."
    with refused(item, "7 values", kind=InvalidValueError) as found:
        COGIRO.replace(winches=Winch(**seven, swivel_axis=[[0, 0, 1]] * 6 + [[0, 0, -1]]))
    assert len(str(found.value)) < 300
    with refused("winches", "7 values", kind=InvalidValueError):
        COGIRO.replace(winches=Winch([0.0] * 7))  # seven times the size of one


def test_axes_of_any_length_become_unit_vectors_and_upright_ones_exactly_vertical() -> None:
    winch = Winch(0.05, swivel_axis=np.array([[0, 0, 7], [0, 0, -1e-3], [1e-12, 0, 1], [0, 3, -4]]))
    expected = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [0.0, 0.6, -0.8]])
    np.testing.assert_allclose(winch.swivel_axis, expected, rtol=1e-15)
    assert winch.slanted.tolist() == [False, False, False, True]


def test_one_winch_is_repeated_for_all_cables() -> None:
    one = Winch(0.05, drum_radius=0.06, swivel_axis=[0, 0, -1])
    spread = one.per_cable(3)
    assert spread.pulley_radius.tolist() == [0.05] * 3
    assert spread.drum_radius is not None
    assert spread.drum_radius.tolist() == [0.06] * 3
    assert spread.swivel_axis.tolist() == [[0.0, 0.0, -1.0]] * 3
    assert spread.inertia is None
    assert spread.per_cable(3) is spread
    assert_same(Winch([0.05], drum_radius=0.06, swivel_axis=[0, 0, -1]).per_cable(3), spread)
    for count in (2, 4):
        with refused("winches", "3 values", f"one value, or {count}, one per cable", kind=InvalidValueError):
            spread.per_cable(count)
    for wrong in (0, -1, 2.5, True):
        with refused("count", f"{wrong}", kind=InvalidValueError):
            one.per_cable(wrong)  # type: ignore[arg-type]
    with refused("the memory for winches", kind=InvalidValueError):
        one.per_cable(10**14)


def test_replace_checks_the_fields_and_keeps_the_original() -> None:
    winch = Winch([0.05, 0.06], gear=-20, swivel_axis=[[0, 0, 1], [0, 0, -1]], inertia=1e-3)
    changed = winch.replace(gear=12, inertia=None)
    assert (changed.gear.tolist(), changed.inertia) == ([12.0, 12.0], None)
    assert winch.gear.tolist() == [-20.0, -20.0]
    assert_same(changed.replace(gear=-20, inertia=1e-3), winch)
    with refused("winches: gear[1]", "0", "not 0", kind=InvalidValueError):
        winch.replace(gear=[1, 0])
    with refused("field", "'geer'", kind=InvalidValueError) as caught:
        winch.replace(geer=1)
    assert set(caught.value.allowed.split(", ")) == set(Winch.__slots__)


def test_pickling_uses_the_constructor() -> None:
    winch = Winch([0.05, 0.06], dead_cable=4, dead_rise=[-1, 2], swivel_axis=[[0, 0, 1], [0, 0, -1]], speed_limit=300)
    copy = pickle.loads(pickle.dumps(winch))
    assert_same(winch, copy)
    with pytest.raises(ValueError, match="read-only"):
        copy.dead_rise[0] = 9.0
    make, (kind, values) = winch.__reduce__()
    with refused("winches: dead_rise[0]", "5 m", kind=InvalidValueError):
        make(kind, {**values, "dead_rise": 5.0})


COGIRO = load_robot("cogiro")


def wound() -> Robot:
    thick = COGIRO.cables.replace(diameter=np.linspace(0.003, 0.01, 8), expansion=1.2e-5)
    winches = Winch(np.linspace(0.01, 0.08, 8), dead_cable=4, drum_radius=np.linspace(0.1, 0.17, 8))
    return COGIRO.replace(winches=winches, cables=thick)


def test_a_robot_takes_as_many_winches_as_cables() -> None:
    assert COGIRO.winches is None
    robot = COGIRO.replace(winches=Winch(0.05))
    assert robot.winches is not None
    assert robot.winches.pulley_radius.tolist() == [0.05] * 8
    assert robot.replace(winches=None).winches is None
    with refused("winches", "7 values", ONE_OR_8, kind=InvalidValueError):
        COGIRO.replace(winches=Winch([0.05] * 7))
    with refused("winches", "0.05", "a Winch", kind=InvalidValueError):
        COGIRO.replace(winches=0.05)
    copy = pickle.loads(pickle.dumps(wound()))
    assert_same(wound().winches or Winch(), copy.winches)


def test_remaining_cables_keep_their_winches() -> None:
    left, kept = without_cables(wound(), 2, 5), np.array([0, 1, 3, 4, 6, 7])
    assert left.winches is not None
    np.testing.assert_array_equal(left.winches.pulley_radius, np.linspace(0.01, 0.08, 8)[kept])
    np.testing.assert_array_equal(left.winches.drum_radius, np.linspace(0.1, 0.17, 8)[kept])
    np.testing.assert_array_equal(left.winches.swivel_axis, [[0, 0, 1]] * 6)
    np.testing.assert_array_equal(left.cables.diameter, np.linspace(0.003, 0.01, 8)[kept])
    np.testing.assert_array_equal(left.cables.expansion, [1.2e-5] * 6)


def test_common_fields_of_the_winches_of_several_robots() -> None:
    thin = wound().replace(cables=wound().cables.replace(expansion=None))
    both = cables_of((wound(), thin))
    assert both.expansion is None
    assert both.diameter is not None
    np.testing.assert_array_equal(both.diameter, np.tile(np.linspace(0.003, 0.01, 8), (2, 1)))
    assert isinstance(both, Cable)
