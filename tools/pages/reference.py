"""Pages of reference: signature and docstring of everything public, by package."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator, Mapping
from enum import Enum
from functools import cached_property
from textwrap import dedent
from types import MappingProxyType, ModuleType
from typing import Any, Final

import sagline as sl

SCENE: Final = """\
import numpy as np

import sagline as sl

robot = sl.load_robot("cogiro")
path = sl.quintic_path([(0, 0, 1.5), (2, 1, 2.5), (-2, 1, 2.5)], speed=1.0)
proof = sl.confirm(sl.inverse(robot, path, model=sl.Elastic()))
again = sl.confirm(sl.inverse(robot, path, model=sl.Empirical()))
pose = sl.Pose.from_euler((1.0, 1.0, 2.0), 0.0, 0.0, 0.0)
shape = sl.tension_polygon(robot, pose)
chosen = {"Closest": sl.inverse(robot, pose).chord_tension}
state = sl.inverse(robot, pose).state
swings = sl.vibration(state, up_to=20.0, damping=sl.Damping(modal_damping=0.01))
some = sl.inverse(robot, path).state[::20]
along = [sl.vibration(each, up_to=8.0) for each in some]
ways = np.meshgrid(*([-3, -1, 1, 3],) * 2, [1, 2, 3], indexing="ij")
grid = sl.Pose(np.stack(ways, axis=-1).reshape(-1, 3), np.eye(3))
found = sl.frequency_map(robot, grid, up_to=8.0)
broken = sl.simulate(state, duration=2.0, events=sl.Break(cable=3, time=0.5))
prototype, home = sl.load_robot("article-prototype"), sl.Pose([0, 0, 1.5], np.eye(3))
controller = sl.control.Controller(prototype, sl.twin.Machine(prototype, seed=1).link(), seed=1)
controller.connect()
controller.home(home)
done = controller.go_to(sl.Pose([0.2, -0.4, 1.4], np.eye(3)))
loads = sl.WrenchBox(force=50.0, moment=5.0)
space = sl.workspace(robot, wrenches=loads, cells=24)
posts = sl.FreeAnchors("frame", -1.0, 1.0, along=[0, 0, 1], symmetry="xy")
goals = [sl.Goal("mean_margin"), sl.Goal("largest_tension")]
calibrated = sl.calibrate(sl.load_robot("winches_robot.yaml"), sl.load_log("winches.csv"))
better = sl.design(robot, [posts], goals, loads, grid=(3, 3, 3), evaluations=300, optimizer="nsga2")
"""
FIGURES: Final = {  # function of `sl.plot` -> a call that draws
    "calibration": "calibration(calibrated)",
    "drawing": "drawing(robot, pose)",
    "energy": "energy(broken)",
    "error": "error(proof)",
    "errors": "errors(proof, again)",
    "execution": "execution(done)",
    "frequencies": "frequencies(along, path.time[::20])",
    "frequency_map": "frequency_map(found)",
    "front": "front(better)",
    "lengths": "lengths(proof.plan)",
    "measured_tensions": "measured_tensions(done)",
    "mendable_tensions": "mendable_tensions(done)",
    "overview": "overview(proof.plan)",
    "path": "path(path)",
    "place_errors": "place_errors(done)",
    "polygon": "polygon(shape, chosen)",
    "response": "response(swings)",
    "robot": "robot(robot, pose)",
    "simulation": "simulation(broken)",
    "slice": 'slice(space, "z", at=2.0)',
    "small_multiples": "small_multiples(proof.plan)",
    "states": "states(done)",
    "tensions": "tensions(proof.plan)",
    "velocity": "velocity(path)",
    "workspace": "workspace(space)",
}
SECTION: Final = re.compile(
    r"^(Args|Attributes|Returns|Yields|Raises|Examples|Source):\n((?:(?: {4}.*)?\n)+)", re.MULTILINE
)
ITEM: Final = re.compile(r"^(\*{0,2}[\w.]+): ((?:.*\n?)(?:^ .*\n?|^\n(?= ))*)", re.MULTILINE)
DOCTEST: Final = re.compile(r"^>>> (?:.+(?:\n|\Z))+", re.MULTILINE)
WIDE: Final = 80  # columns of a signature on one line


class Plain(str):
    """Text that is its own representation: annotations without quotes."""

    __repr__ = str.__str__


def reference_pages() -> dict[str, str]:
    """The pages of reference by address."""
    groups = {name: group for name in sl.__all__ if isinstance(group := getattr(sl, name), ModuleType)}
    pages: dict[str, dict[str, Any]] = {name: {} for name in groups}
    for group in groups:
        for name, value in ((name, getattr(groups[group], name)) for name in groups[group].__all__):
            if callable(value) and hasattr(value, "__module__"):
                folder = value.__module__.split(".")[1]
                pages[folder if folder in pages else group][name] = value
    links = {name: f"{page}.md#{anchor(value)}" for page, values in pages.items() for name, value in values.items()}
    return {f"api/{name}.md": _page(groups[name], values, links) for name, values in pages.items()}


def anchor(value: Any) -> str:
    """The full name of something public."""
    return f"{value.__module__}.{value.__qualname__}"


def _page(group: ModuleType, values: dict[str, Any], links: dict[str, str]) -> str:
    """One page, functions first, then types; each function of `sl.plot` with an example figure."""
    parts = [f"# {group.__name__}\n\n{inspect.getdoc(group)}"]
    if group is sl.plot:
        parts.append(f"The figures below use these objects:\n\n```python\n{SCENE}```")
        if wrong := {*values} - {*FIGURES, "film", "save", "style"}:
            raise ValueError(f"no figure in the reference for sl.plot: {', '.join(wrong)}; add calls to FIGURES")
    for name in sorted(values, key=lambda name: (name[0].isupper(), name.lower())):
        parts += _entry(name, values[name], links)
        if group is sl.plot and name in FIGURES:
            file = f"plot-{name}.svg"
            parts.append(f'```python\nsl.plot.save(sl.plot.{FIGURES[name]}, "{file}")\n```')
            parts.append(f"<!-- drawn above: {file} -->")
    return "\n\n".join(filter(None, parts)) + "\n"


def _entry(name: str, value: Any, links: dict[str, str]) -> Iterator[str]:
    """Heading, signature and docstring of a function or a type, and of the members of the type."""
    yield f"## {name} {{ #{anchor(value)} }}"
    if not isinstance(value, type):
        yield from _callable(name, value, links)
        return
    if bases := [_linked(base.__name__, links) for base in value.__bases__ if base.__name__ in links]:
        yield f"Bases: {', '.join(bases)}"
    kinds = {key: kind for base in reversed(value.__mro__) for key, kind in inspect.get_annotations(base).items()}
    own = vars(value).get("__init__")
    if not issubclass(value, (Enum, Exception)):
        yield f"```py\n{signature(name, value)}\n```"
    yield documented(value.__dict__.get("__doc__"), links, kinds)
    yield documented(getattr(own, "__doc__", None), links)
    for key, member in sorted(vars(value).items()):
        if key.startswith("_") or not getattr(member, "__doc__", None):
            continue
        heading = f"### {key} {{ #{anchor(value)}.{key} }}"
        if isinstance(member, (property, cached_property)):
            getter = member.fget if isinstance(member, property) else member.func
            kind = inspect.get_annotations(getter).get("return", "Any") if getter else "Any"
            yield from (heading, f"```py\n{key}: {kind}\n```", documented(member.__doc__, links))
        elif isinstance(member, (classmethod, staticmethod)) or inspect.isfunction(member):
            yield from (heading, *_callable(key, getattr(value, key), links, method=inspect.isfunction(member)))


def _callable(name: str, value: Any, links: dict[str, str], method: bool = False) -> Iterator[str]:
    returned = inspect.signature(value).return_annotation
    yield f"```py\n{signature(name, value, method)}\n```"
    yield documented(value.__doc__, links, {"Returns": returned})


def signature(name: str, value: Any, method: bool = False) -> str:
    """The call of a function or type, over several lines if it is long."""
    found = inspect.signature(value)
    rows: list[str] = []
    for parameter in list(found.parameters.values())[method:]:
        if parameter.kind is parameter.KEYWORD_ONLY and not any(row.startswith("*") for row in rows):
            rows.append("*")
        kind = parameter.annotation
        rows.append(str(parameter.replace(annotation=Plain(kind) if isinstance(kind, str) else kind)))
    end = "" if isinstance(value, type) else f" -> {found.return_annotation}"
    text = f"{name}({', '.join(rows)}){end}"
    return text if len(text) <= WIDE else f"{name}(\n    " + ",\n    ".join(rows) + f",\n){end}"


def documented(text: str | None, links: dict[str, str], kinds: Mapping[str, Any] = MappingProxyType({})) -> str:
    """A docstring as Markdown; `kinds` are the annotations of its attributes, or that of `Returns`."""

    def section(found: re.Match[str]) -> str:
        body = dedent(found[2]).strip("\n")
        if found[1] == "Examples":
            body = DOCTEST.sub(lambda each: f"```pycon\n{each[0].rstrip()}\n```\n", body)
        elif found[1] in ("Args", "Attributes", "Raises"):
            named = links if found[1] == "Raises" else {}
            body = ITEM.sub(lambda item: _item(_linked(item[1], named), item[2], links, kinds.get(item[1])), body)
        elif found[1] == "Returns" and isinstance(kind := kinds.get("Returns"), str):
            body = f"- {_linked(kind, links)}: {' '.join(body.split())}"
        return f"**{found[1].replace('Args', 'Parameters')}**\n\n{body.strip()}\n\n"

    return SECTION.sub(section, inspect.cleandoc(text or "") + "\n").strip()


def _item(title: str, text: str, links: dict[str, str], kind: object) -> str:
    of_kind = f" ({_linked(kind, links)})" if isinstance(kind, str) else ""
    return f"- **{title}**{of_kind}: {' '.join(text.split())}\n"


def _linked(name: str, links: dict[str, str]) -> str:
    return f"[`{name}`]({links[name]})" if name in links else f"`{name}`"
