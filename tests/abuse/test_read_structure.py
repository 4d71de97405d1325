"""Files with parts that are missing, repeated, misplaced, of another type, or nested in each other."""

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml

from sagline import SaglineError
from tests.abuse.reading import LENGTHS, MEASURED, PATH, READERS, ROBOT, WAYPOINTS, Reader, judged, sound
from tests.tiers import wide

STRANGE: tuple[Any, ...] = (
    *(None, True, False, "", " ", "x", 0, -1, 1e-300, 1e49, float("inf"), float("nan"), 10**40, "5 m", "1:30", "yes"),
    *([], [[]], [[[]]], {}, [None], {"a": 1}, {"": ""}, {1: 2}, {None: None}, [1, [2]], [[1, 2], [3]], [[]] * 500),
    *("x" * 2000, "\x1b[31m", "a\0b", "\ud800", "a\nb\nc", "\u202e", "../../evil", "名" * 150, "%s{0}", "2020-01-01"),
    *([[0, 0, 0]] * 1000, [1e300] * 4, list(range(3000)), [[1, 2, 3]] * 3, "&a", "*a", "<<", "!!set"),
)
NAMES = (
    "",
    "x",
    "naem",
    "mass ",
    "Mass",
    "__class__",
    "name\x1b[2J",
    "\ud800",
    "ключ",
    "k" * 3000,
    "inertia",
    "1",
    "~",
)


def slots(tree: Any) -> list[tuple[Any, Any]]:
    """All positions in a tree of mappings and lists: the container and the key."""
    keys = list(tree) if isinstance(tree, dict) else list(range(len(tree))) if isinstance(tree, list) else []
    return [(tree, key) for key in keys] + [place for key in keys for place in slots(tree[key])]


def dropped(rng: np.random.Generator, holder: Any, key: Any, tree: Any) -> None:
    del holder[key]


def replaced(rng: np.random.Generator, holder: Any, key: Any, tree: Any) -> None:
    holder[key] = copy.deepcopy(STRANGE[int(rng.integers(len(STRANGE)))])


def renamed(rng: np.random.Generator, holder: Any, key: Any, tree: Any) -> None:
    name = NAMES[int(rng.integers(len(NAMES)))]
    if isinstance(holder, dict):
        holder[name] = holder.pop(key)
    else:
        holder[key] = {name: holder[key]}


def nested(rng: np.random.Generator, holder: Any, key: Any, tree: Any) -> None:
    for _ in range(int(rng.integers(1, 30))):
        holder[key] = [holder[key]] if rng.integers(2) else {"deeper": holder[key]}


def swapped(rng: np.random.Generator, holder: Any, key: Any, tree: Any) -> None:
    places = slots(tree)
    other, name = places[int(rng.integers(len(places)))]
    holder[key], other[name] = copy.deepcopy(other[name]), copy.deepcopy(holder[key])


def repeated(rng: np.random.Generator, holder: Any, key: Any, tree: Any) -> None:
    holder[key] = [copy.deepcopy(holder[key]) for _ in range(int(rng.integers(2, 9)))]


TREE_CHANGES: tuple[Callable[..., None], ...] = (dropped, replaced, replaced, renamed, nested, swapped, repeated)


@pytest.mark.parametrize("count", wide([20, 120, pytest.param(2000, marks=pytest.mark.soak)]))
def test_trees_in_yaml(count: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(20260112)
    trees = {"robot.yaml": yaml.safe_load(ROBOT), "tour.yaml": yaml.safe_load(WAYPOINTS)}
    for k in range(count):
        reader = READERS[k % 2]
        tree, done = copy.deepcopy(trees[reader.name]), []
        for _ in range(int(rng.integers(1, 4))):
            places = slots(tree)
            if places:
                change = TREE_CHANGES[int(rng.integers(len(TREE_CHANGES)))]
                change(rng, *places[int(rng.integers(len(places)))], tree)
                done.append(change.__name__)
        # JSON is valid YAML, and YAML reads its escape sequences
        text = json.dumps(_stringed(tree)) if rng.integers(2) else yaml.dump(tree, allow_unicode=bool(rng.integers(2)))
        _check(reader, text.encode("utf-8", "surrogatepass"), f"case {k}: {reader.name}, {', '.join(done)}", tmp_path)


@pytest.mark.parametrize("count", wide([20, 100, pytest.param(2000, marks=pytest.mark.soak)]))
def test_elements_of_xml(count: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(20260113)
    readers = [reader for reader in READERS if reader.sample.startswith("<")]
    words = [str(word) for word in (*STRANGE, *NAMES) if isinstance(word, str | int | float)]
    for k in range(count):
        reader = readers[k % len(readers)]
        root = ElementTree.fromstring(reader.sample)
        for _ in range(int(rng.integers(1, 4))):
            _change_element(rng, root, words)
        data = ElementTree.tostring(root, encoding=("utf-8", "us-ascii", "utf-16")[int(rng.integers(3))])
        _check(reader, data, f"case {k}: {reader.name}", tmp_path)


def _change_element(rng: np.random.Generator, root: ElementTree.Element, words: list[str]) -> None:
    word = words[int(rng.integers(len(words)))].encode("utf-8", "ignore").decode()
    holders = [element for element in root.iter() if len(element)]
    holder = holders[int(rng.integers(len(holders)))] if holders else root
    child = holder[int(rng.integers(len(holder)))] if len(holder) else root
    kind = int(rng.integers(7))
    if kind == 0 and child is not root:
        holder.remove(child)
    elif kind == 1:
        holder.append(copy.deepcopy(child))
    elif kind == 2 and child.attrib:
        child.set(list(child.attrib)[int(rng.integers(len(child.attrib)))], word)
    elif kind == 3 and child.attrib:
        del child.attrib[list(child.attrib)[int(rng.integers(len(child.attrib)))]]
    elif kind == 4:
        child.text = word
    elif kind == 5:
        child.tag = ("cable", "link_rigid", "robot", "platform", "x" * 500, "joint", "attachment")[int(rng.integers(7))]
    else:
        for _ in range(int(rng.integers(1, 300))):
            wrapped = copy.copy(child)
            wrapped[:] = []
            holder.append(wrapped)


@pytest.mark.parametrize("count", wide([20, 100, pytest.param(2000, marks=pytest.mark.soak)]))
def test_rows_and_columns_of_tables(count: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(20260114)
    samples = {"tour.csv": PATH, "lengths.csv": LENGTHS, "cable.csv": MEASURED}
    readers = [reader for reader in READERS if reader.name in samples]
    heads = (
        "time []",
        "time [ ]",
        "L0 [5]",
        "L0 [m][m]",
        "x [1/0]",
        "span [rad]",
        "qx",
        "y",
        "z [mm/mm]",
        "L9",
        "длина",
        "",
    )
    cells = (
        "",
        "1,5",
        '"1,5"',
        "nan",
        "1e60",
        "x",
        "\x1b[2J",
        "=1+1",
        "-1",
        "0",
        "9" * 5000,
        "5 m",
        '"',
        "\ud800",
        "1_0",
    )
    for k in range(count):
        reader = readers[k % len(readers)]
        rows = [line.split(",") for line in reader.sample.splitlines()]
        for _ in range(int(rng.integers(1, 3))):
            r, c = int(rng.integers(len(rows))), int(rng.integers(len(rows[0])))
            kind = int(rng.integers(9))
            if kind == 0:
                rows[0][c % len(rows[0])] = heads[int(rng.integers(len(heads)))]
            elif kind == 1:
                rows[r][c % len(rows[r]) :] = [cells[int(rng.integers(len(cells)))]]
            elif kind == 2:
                rows[r][c % len(rows[r])] = cells[int(rng.integers(len(cells)))]
            elif kind == 3:
                rows = [row[:c] + row[c + 1 :] or [""] for row in rows]
            elif kind == 4:
                rows = [[*row, row[c % len(row)]] for row in rows]
            elif kind == 5:
                rows.insert(r, list(rows[int(rng.integers(len(rows)))]))
            elif kind == 6:
                rows = rows[::-1] if rng.integers(2) else rows[:r] or [[""]]
            elif kind == 7:
                rows[r:] = [rows[r]] * int(rng.integers(2, 3000))
            elif len(rows) < 100:
                rows = [[*row[:9]] * 200 for row in rows]
        mark = (",", ",", ",", ";", "\t", ", ", "|", " ")[int(rng.integers(8))]
        text = "\n".join(mark.join(row) for row in rows)
        if rng.integers(8) == 0:
            text = text.replace(".", ",")
        _check(reader, text.encode("utf-8", "surrogatepass"), f"case {k}: {reader.name}", tmp_path)


def _check(reader: Reader, data: bytes, what: str, folder: Path) -> None:
    found = judged(lambda: reader.read(reader.written(folder, data)), what)
    if not isinstance(found, SaglineError):
        sound(found, what)


def _stringed(tree: Any) -> Any:
    """The tree with keys as strings, as JSON requires."""
    if isinstance(tree, dict):
        return {str(key): _stringed(value) for key, value in tree.items()}
    return [_stringed(value) for value in tree] if isinstance(tree, list) else tree
