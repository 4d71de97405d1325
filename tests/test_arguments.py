"""Checks of the objects that a caller gives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline import FileError, InvalidValueError
from sagline.core.arguments import choice, file_path, instance, label, part_of, whole_number
from sagline.core.arguments import text as text_of
from sagline.core.errors import NoBatchError, NoSuchEntryError
from tests.refusal import refused

ROBOT = sl.load_robot("cogiro")
POSE = sl.Pose.from_euler([1.0, 1.0, 2.0], 0.0, 0.0, 0.0)
PLAN = sl.inverse(ROBOT, POSE)


ANY: Any = sl  # for calls that the types forbid


@pytest.mark.parametrize(
    ("call", "parts"),
    [
        (lambda: ANY.stiffness(ROBOT), ("state", "a Robot", "an Equilibrium")),
        (lambda: ANY.capacity_margin(sl.confirm(PLAN)), ("state", "a Confirmation", "an Equilibrium")),
        (
            lambda: ANY.confirm(ANY.confirm(PLAN)),
            ("plan", "a Confirmation", "a Plan", "Give confirmation.plan."),
        ),
        (lambda: ANY.inverse(ROBOT, POSE, sl.Straight), ("model", "the class Straight", "a CableModel")),
        (
            lambda: ANY.inverse(ROBOT, POSE, "exact"),
            ("model", "'exact'", "straight, elastic, empirical, parabolic, catenary"),
        ),
        (
            lambda: ANY.inverse(ROBOT, POSE, tension="centroids"),
            ("tension", "'centroids'", None, "Did you mean centroid?"),
        ),
        (lambda: ANY.inverse(ROBOT, POSE, tension=sl.Centroid), ("tension", "the class Centroid", "a TensionMethod")),
        (lambda: ANY.inverse(ROBOT, {1, 2}), ("motion", "{1, 2}", "a Pose or a Path")),
        (
            lambda: ANY.InverseSolver([ROBOT]),
            ("robot", "[a Robot]", "a Robot", 'Load one by name or file: load_robot("cogiro").'),
        ),
        (lambda: ANY.ForwardSolver([ROBOT]), ("robot", "[a Robot]", "a Robot")),
        (lambda: ANY.tension_polygon([ROBOT], POSE), ("robot", "[a Robot]", "a Robot")),
        (lambda: ANY.inverse(ROBOT, POSE, progress=True), ("progress", "True")),
        (lambda: ANY.InverseSolver(ROBOT, 0), ("model", "0", "a CableModel")),
        (lambda: ANY.CableModel(), ("CableModel()", "the abstract base class")),
        (lambda: ANY.TensionMethod(), ("TensionMethod()", "the abstract base class")),
    ],
)
def test_a_wrong_type_is_named_with_a_way_to_create_the_right_one(call: Any, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=InvalidValueError):
        call()


@pytest.mark.parametrize("kind", [sl.Straight, sl.Centroid])
def test_a_class_in_place_of_an_instance_is_answered_with_its_call(kind: type) -> None:
    with pytest.raises(InvalidValueError) as caught:
        ANY.inverse(ROBOT, POSE, **{"model" if kind is sl.Straight else "tension": kind})
    assert f"{kind.__name__}()" in caught.value.next_step


def test_a_valid_object_is_returned_unchanged() -> None:
    assert instance(ROBOT, sl.Robot, "robot") is ROBOT
    assert choice(np.str_("3T"), "pattern", ("3T", "2T")) == "3T"
    assert whole_number(np.int8(3), "points", 2) == 3


@pytest.mark.parametrize("count", [1, 8, 60])
def test_a_long_list_of_words_ends_with_a_whole_word_and_the_number_of_the_others(count: int) -> None:
    words = [f"word_{'x' * (k % 7)}_{k}" for k in range(count)]
    with pytest.raises(InvalidValueError) as caught:
        choice("?", "name", words)
    assert caught.value.allowed == ", ".join(words)
    listed, _, others = str(caught.value).split("allowed: ")[1].partition(". ")[0].partition(" and ")
    shown = listed.split(", ")
    assert shown == words[: len(shown)]
    assert others == ("" if count < 60 else f"{count - len(shown)} more")
    assert len(str(caught.value)) > (0 if count < 60 else 270)  # as many words as fit


@pytest.mark.parametrize(
    ("call", "parts"),
    [
        (lambda: whole_number(1, "points", 2), ("points", "1", ">= 2")),
        (lambda: whole_number(1.5, "points", 2), ("points", "1.5", "a whole number, >= 2")),
        (lambda: whole_number(9, "points", 2, 8), ("points", "9", "2 to 8")),
        (lambda: sl.Break(cable=-1, time=0.0), ("cable", "-1", "0 to 9999")),
        (lambda: sl.Brake(winch=-1, time=0.0), ("winch", "-1", "0 to 9999")),
    ],
)
def test_a_message_names_the_finite_ends_of_a_range(call: Any, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=InvalidValueError):
        call()


BATCH = np.arange(12.0).reshape(4, 3)
TAKEN = [0, -4, slice(1, 3), slice(None, None, -2), [3, 0], np.array([1, 1]), [], BATCH[:, 0] > 2]
REFUSED = [4, -5, (0, 1), None, ..., 1.0, "0", True, [0, 4], [0.0], [[0]], np.ones(3, bool), {0}]


@pytest.mark.parametrize("index", TAKEN)
def test_an_index_accepts_the_integers_of_numpy(index: Any) -> None:
    np.testing.assert_array_equal(BATCH[part_of(index, BATCH.shape, "single row")], BATCH[index])


@pytest.mark.parametrize("index", REFUSED)
def test_an_index_out_of_range_is_an_index_error(index: Any) -> None:
    with refused("index", kind=IndexError) as caught:
        part_of(index, BATCH.shape, "single row")
    assert caught.value.allowed.startswith("-4 to 3, ")
    with pytest.raises(NoSuchEntryError):
        sl.inverse(ROBOT, sl.Pose(np.tile(POSE.position, (4, 1)), np.eye(3))).state[index]


def test_a_single_pose_has_no_length() -> None:
    for single in (POSE, PLAN.state, PLAN.state.cables[0]):
        with refused("this", allowed="a batch", kind=NoBatchError):
            list(single)
        with refused("index", "0", "none", kind=TypeError):
            single[0]


@pytest.mark.parametrize("file", ["a" * 256, "x\0y", "\ud800", ".", "", "/", f"folder/{'a' * 300}/x"])
def test_impossible_file_names_are_refused(file: str) -> None:
    with pytest.raises(FileError):
        file_path(file)


def test_the_longest_names_are_accepted() -> None:
    assert file_path("ä" * 127 + "a") == Path("ä" * 127 + "a")  # 255 bytes
    assert file_path(".", folder=True) == Path(".")


@pytest.mark.parametrize("text", ["cogiro", "größer 2", "名" * 100, "a-b_c.d/.."])
def test_valid_names(text: str) -> None:
    assert label(text, "name") == text


@pytest.mark.parametrize(("text", "shown"), [("", "empty"), (" ", "blank"), ("\u3000", "blank")])
def test_an_empty_name_is_refused(text: str, shown: str) -> None:
    with refused("name", shown, kind=InvalidValueError):
        label(text, "name")


@pytest.mark.parametrize("text", ["a" * 101, "a\nb", "a\tb", "\x1b[31m", "a\0", "\ud800", "\u202egnp", 5, None, b"a"])
def test_invalid_names(text: object) -> None:
    with refused("name", kind=InvalidValueError) as caught:
        label(text, "name")
    assert " 100 " in caught.value.allowed
    assert len(str(caught.value)) < 300


def test_texts_may_contain_line_breaks_and_no_control_characters() -> None:
    assert text_of("two\n\tlines" * 1000, "notes") == "two\n\tlines" * 1000
    for text in ("\x1b]0;x\x07", "a\rb", "\ud800", 5):
        with refused("notes", kind=InvalidValueError):
            text_of(text, "notes")
