"""The machine between encoder and cable, as data."""

import pickle
from typing import Any

import numpy as np
import pytest

from sagline.cables.cable import Cable
from sagline.errors import InvalidValueError
from sagline.files.robot_file import load_robot
from sagline.robot.robot import Robot
from sagline.robot.several import cables_of
from sagline.robot.winch import RULES, Winch
from sagline.tension.broken import without_cables

# beside a value of 2 or 3 for every field: what else must be there
BESIDE: dict[str, dict[str, float]] = {"dead_rise": {"dead_cable": 5.0}}
# which values a field refuses, by hand from what it is
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


def fields_of(winch: Winch) -> dict[str, Any]:
    return {name: getattr(winch, name) for name in Winch.__slots__}


def assert_same(winch: Winch, other: Winch) -> None:
    for name, field in fields_of(winch).items():
        np.testing.assert_array_equal(getattr(other, name), field, err_msg=name)


def test_a_winch_of_nothing_is_an_eyelet_that_counts_turns() -> None:
    found = {name: field for name, field in fields_of(Winch()).items() if field is not None}
    assert set(RULES) - set(found) == set(UNKNOWN)
    assert {name for name, field in found.items() if field.ndim == 0 and field == 1.0} == {
        "layers",
        "gear",
        "load_cell_gain",
    }
    assert found.pop("swivel_axis").tolist() == [0.0, 0.0, 1.0]
    assert all(field in (0.0, 1.0) for field in found.values())


@pytest.mark.parametrize("name", [name for name in RULES if name != "rolling_friction"])
def test_every_field_holds_what_it_is_given(name: str) -> None:
    beside: dict[str, Any] = BESIDE.get(name, {})
    assert getattr(Winch(**beside, **{name: 2}), name).tolist() == 2.0
    several = Winch(**beside, **{name: [2, 3, 2]})
    assert getattr(several, name).tolist() == [2.0, 3.0, 2.0]
    assert several.shape == (3,)
    assert several.swivel_axis.tolist() == [[0.0, 0.0, 1.0]] * 3
    for field in several.known().values():
        assert field.shape[:1] == (3,)
        assert not field.flags.writeable


def cases() -> list[tuple[str, Any, str]]:
    """A field, a value that it refuses, and what the message says of the value and what is allowed."""
    found: list[tuple[str, Any, str]] = []
    for name, rule in RULES.items():
        unit = f" {rule.unit}".rstrip().replace("^", r"\^")
        found += [
            (name, np.nan, rf"is nan{unit}; allowed: .*finite"),
            (name, [2.0, np.inf, 2.0], rf"\[1\] is inf{unit}; allowed: .*finite"),
            (name, [2.0, 1e300], rf"\[1\] is 1e\+300{unit}"),
            (name, "fast", "is 'fast'; allowed: numbers"),
            (name, 1j, "is complex.*allowed: numbers"),
            (name, [[2.0, 2.0]], r"is of shape \(1, 2\); allowed: shape \(\) or \(m,\)"),
            (name, [], r"is of shape \(0,\); allowed: shape"),
            (name, object(), "is .*object.*; allowed: numbers"),
        ]
        if name in NEVER_NEGATIVE:
            found += [
                (name, -1.0, rf"is -1{unit}; allowed: >"),
                (name, [2, -1e-9], rf"\[1\] is -1e-09{unit}; allowed: >"),
            ]
        if name in NEVER_ZERO:
            found += [
                (name, 0.0, "is 0.*; allowed: (>|not 0)"),
                (name, [2.0, 0.0], r"\[1\] is 0.*; allowed: (>|not 0)"),
            ]
        if name not in UNKNOWN:
            found.append((name, None, "is None; allowed: numbers"))
    found += [("layers", [1.0, 2.0, 1.5], r"\[2\] is 1.5; allowed: whole numbers"), ("layers", 0.5, "is 0.5")]
    axes: tuple[tuple[Any, str], ...] = (
        ([0, 0, 0], "is the zero vector; allowed: up or down"),
        ([1, 0, 0], r"is \(1, 0, 0\); allowed: up or down.*does not swivel, is not modeled"),
        ([0, 1e-6, -1], r"is \(0, 1e-06, -1\); allowed: up or down"),
        ([[0, 0, 1], [0, -1, 1]], r"is \(0, -0.707, 0.707\); allowed: up or down"),
        ([0, 1], r"is of shape \(2,\)"),
        (1.0, r"is of shape \(\)"),
        ([0, 0, np.nan], r"\[2\] is nan"),
        ([[[0, 0, 1]]], r"is of shape \(1, 1\)"),
        (None, "is None"),
    )
    return found + [("swivel_axis", value, message) for value, message in axes]


@pytest.mark.parametrize(("name", "value", "message"), cases())
def test_what_no_winch_has_is_refused_by_name(name: str, value: Any, message: str) -> None:
    with pytest.raises(InvalidValueError, match=f"^winches: {name} ?{message}") as found:
        Winch(**{**BESIDE.get(name, {}), name: value})
    text = str(found.value)
    assert len(text) < 300
    assert "\n" not in text
    assert found.value.next_step


@pytest.mark.parametrize("name", [name for name in RULES if name != "pulley_radius"])
def test_seven_of_eight_rows_are_named(name: str) -> None:
    with pytest.raises(
        InvalidValueError, match=f"^winches: {name} is 7 values; allowed: one value, or 8, as pulley_radius"
    ):
        Winch([0.05] * 8, **{name: [2.0] * 7})


def test_the_longest_block_counts() -> None:
    with pytest.raises(
        InvalidValueError, match=r"^winches: pulley_radius is 7 values; allowed: one value, or 8, as gear"
    ):
        Winch([0.05] * 7, gear=[1.0] * 8)
    with pytest.raises(InvalidValueError, match=r"^winches: swivel_axis is 2 values; allowed: one value, or 3"):
        Winch([0.05] * 3, swivel_axis=[[0, 0, 1]] * 2)
    assert Winch([0.05], gear=[1.0, 2.0]).pulley_radius.tolist() == [0.05, 0.05]


def test_a_run_rises_by_no_more_than_its_length() -> None:
    assert Winch(dead_cable=[2.0, 3.0], dead_rise=[-2.0, 3.0]).dead_rise.tolist() == [-2.0, 3.0]
    with pytest.raises(InvalidValueError, match=r"dead_rise\[1\] is -3.1 m; allowed: within \+-3 m, its dead_cable"):
        Winch(dead_cable=3.0, dead_rise=[3.0, -3.1])


def test_a_cable_is_no_shorter_than_its_run() -> None:
    assert Winch(dead_cable=[2.0, 3.0], cable_length=3.0).dead_cable.tolist() == [2.0, 3.0]
    with pytest.raises(InvalidValueError, match=r"cable_length\[1\] is 2.9 m; allowed: >= 3 m, its dead_cable"):
        Winch(dead_cable=[2.0, 3.0], cable_length=2.9)


@pytest.mark.parametrize("name", RULES)
def test_the_field_with_too_few_values_for_a_robot_is_named(name: str) -> None:
    beside: dict[str, Any] = BESIDE.get(name, {})
    other: dict[str, Any] = {"inertia" if name == "pulley_radius" else "pulley_radius": 0.05}
    two, three = (0.2, 0.3) if name == "rolling_friction" else (2, 3)
    with pytest.raises(InvalidValueError, match=f"^winches: {name} is 7 values; allowed: one value, or 8, one a cable"):
        COGIRO.replace(winches=Winch(**beside, **other, **{name: [two, three, two, three, two, three, two]}))
    with pytest.raises(InvalidValueError, match=r"^winches is 7 values; allowed: one value, or 8"):
        COGIRO.replace(winches=Winch(**beside, **other, **{name: [two] * 7}))  # nothing tells which it was


def test_a_block_of_seven_winches_is_named_in_one_line() -> None:
    seven: dict[str, Any] = {name: [2, 3, 2, 3, 2, 3, 2] for name in RULES}
    for name in ("dead_rise", "dead_cable", "rolling_friction"):
        del seven[name]
    with pytest.raises(
        InvalidValueError, match=r"^winches: pulley_radius, swivel_axis, pulley_friction, \.\.\. is 7"
    ) as found:
        COGIRO.replace(winches=Winch(**seven, swivel_axis=[[0, 0, 1]] * 6 + [[0, 0, -1]]))
    assert len(str(found.value)) < 300
    with pytest.raises(InvalidValueError, match=r"^winches is 7 values"):
        COGIRO.replace(winches=Winch([0.0] * 7))  # seven times what it is anyway


def test_axes_of_any_length_become_vertical_unit_vectors() -> None:
    axes = Winch(swivel_axis=np.array([[0, 0, 7], [0, 0, -1e-3], [1e-12, 0, 1]])).swivel_axis
    np.testing.assert_array_equal(axes, [[0, 0, 1], [0, 0, -1], [0, 0, 1]])


def test_one_winch_is_spread_over_the_cables() -> None:
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
        told = f"^winches is 3 values; allowed: one value, or {count}"
        with pytest.raises(InvalidValueError, match=told):
            spread.per_cable(count)
    for wrong in (0, -1, 2.5, True, 10**14):
        with pytest.raises(InvalidValueError, match=r"count is|winches is"):
            one.per_cable(wrong)  # type: ignore[arg-type]


def test_replace_checks_again_and_leaves_the_original() -> None:
    winch = Winch([0.05, 0.06], gear=-20, swivel_axis=[[0, 0, 1], [0, 0, -1]], inertia=1e-3)
    changed = winch.replace(gear=12, inertia=None)
    assert (changed.gear.tolist(), changed.inertia) == ([12.0, 12.0], None)
    assert winch.gear.tolist() == [-20.0, -20.0]
    assert_same(changed.replace(gear=-20, inertia=1e-3), winch)
    with pytest.raises(InvalidValueError, match=r"winches: gear\[1\] is 0"):
        winch.replace(gear=[1, 0])
    with pytest.raises(InvalidValueError, match="field is 'geer'; allowed: pulley_radius"):
        winch.replace(geer=1)


def test_pickling_goes_through_the_constructor() -> None:
    winch = Winch([0.05, 0.06], dead_cable=4, dead_rise=[-1, 2], swivel_axis=[[0, 0, 1], [0, 0, -1]], speed_limit=300)
    copy = pickle.loads(pickle.dumps(winch))
    assert_same(winch, copy)
    with pytest.raises(ValueError, match="read-only"):
        copy.dead_rise[0] = 9.0
    make, values = winch.__reduce__()
    with pytest.raises(InvalidValueError, match="dead_rise"):
        make({**values[0], "dead_rise": 5.0})


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
    with pytest.raises(InvalidValueError, match=r"^winches is 7 values; allowed: one value, or 8, one a"):
        COGIRO.replace(winches=Winch([0.05] * 7))
    with pytest.raises(InvalidValueError, match=r"^winches is 0\.05; allowed: a Winch"):
        COGIRO.replace(winches=0.05)
    copy = pickle.loads(pickle.dumps(wound()))
    assert_same(wound().winches or Winch(), copy.winches)


def test_cables_that_are_left_keep_their_winches() -> None:
    left, kept = without_cables(wound(), 2, 5), np.array([0, 1, 3, 4, 6, 7])
    assert left.winches is not None
    np.testing.assert_array_equal(left.winches.pulley_radius, np.linspace(0.01, 0.08, 8)[kept])
    np.testing.assert_array_equal(left.winches.drum_radius, np.linspace(0.1, 0.17, 8)[kept])
    np.testing.assert_array_equal(left.winches.swivel_axis, [[0, 0, 1]] * 6)
    np.testing.assert_array_equal(left.cables.diameter, np.linspace(0.003, 0.01, 8)[kept])
    np.testing.assert_array_equal(left.cables.expansion, [1.2e-5] * 6)


def test_what_all_cables_of_several_robots_know() -> None:
    thin = wound().replace(cables=wound().cables.replace(expansion=None))
    both = cables_of((wound(), thin))
    assert both.expansion is None
    assert both.diameter is not None
    np.testing.assert_array_equal(both.diameter, np.tile(np.linspace(0.003, 0.01, 8), (2, 1)))
    assert isinstance(both, Cable)
