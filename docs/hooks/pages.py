"""Hooks of MkDocs: generated pages, which are always up to date.

The gallery runs the examples, the reference lists all public names, and the command's page is its help text.
"""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType
from typing import Any

import typer.main
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from running import EXAMPLES, WORK, fresh_folder, ran
from shown import SHOWN

import sagline as sl
from sagline.cli.main import app

RINGS = {  # package -> title and opening line of its page of reference
    "cables": ("Cables", "One cable: its material, its models, its state."),
    "robot": ("Robots", "Anchors, cables, platform and pose."),
    "motion": ("Motion", "Paths of the platform."),
    "kinematics": ("Kinematics", "Lengths from a motion, the pose from lengths, and the proof of a plan."),
    "calibration": ("Calibration", "Parameters of a robot from its readings, and informative poses."),
    "dynamics": ("Dynamics", "Vibration and motion in time."),
    "workspaces": ("Workspaces", "Loads, margins, criteria, the boundary, and proofs."),
    "interference": ("Interference", "Clearances of cables, platform and obstacles."),
    "tension": ("Tension", "Tension distribution methods."),
    "statics": ("Statics", "Structure matrix, wrenches, stiffness."),
    "optimization": ("Optimization", "Design variables, goals and optimizers."),
    "control": ("Controller", "`sl.control`: the controller of a machine, cycle by cycle."),
    "plc": ("Links", "`sl.plc`: links to PLCs, over S7 or Modbus."),
    "twin": ("Twin", "`sl.twin`: a simulated machine, in this process or behind servers."),
    "article": ("Identification", "Constants of cables and of the empirical model, from measurements."),
    "files": ("Files", "Input and output files."),
    "sweep": ("Sweeps", "`sl.sweep`: every robot at every pose under every wrench, on many cores."),
    "plot": ("Figures", "`sl.plot`: figures for papers, on Matplotlib."),
    "core": ("Errors", "`sl.core`: exceptions of sagline."),
}
SCENE = """\
import numpy as np

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
FIGURES = {  # function of `sl.plot` -> a call that draws
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
LOADED = re.compile(
    r"""<(?:script|img|iframe|source|video|audio)\b[^>]*\bsrc(?:set)?=["']?(?:https?:)?//|<link\b[^>]*\brel=["']?"""
    r"""(?:stylesheet|preload|preconnect|icon)["']?[^>]*\bhref=["']?(?:https?:)?//|@import\s+["'(]*(?:url\()?https?:"""
    r"""|url\(["']?https?:"""
)


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Complete the navigation: existing background pages, and one page of reference for each package."""
    nav: list[dict[str, list[str]] | str] = config.nav or []
    for section in nav:
        if isinstance(section, dict) and "Background" in section:
            written = {page for page in section["Background"] if (Path(config.docs_dir) / page).is_file()}
            section["Background"] = [page for page in section["Background"] if page in written]
    nav.append({"Reference": [f"api/{ring}.md" for ring in names_by_ring()] + ["api/command.md"]})
    config.nav = nav
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages and figures."""
    fresh_folder()
    files.append(File.generated(config, "gallery.md", content=gallery(files, config)))
    files.append(File.generated(config, "api/command.md", content=command_reference()))
    for ring, names in names_by_ring().items():
        text = reference(ring, names)
        files.append(File.generated(config, f"api/{ring}.md", content=with_figures(text) if ring == "plot" else text))
    for name in FIGURES:
        files.append(File.generated(config, f"api/plot-{name}.svg", abs_src_path=str(WORK / f"plot-{name}.svg")))
    return files


def names_by_ring() -> dict[str, list[str]]:
    """Full names of everything public, by package, including the lists of public modules such as `sl.plot`."""
    groups = [group for name in sl.__all__ if isinstance(group := getattr(sl, name), ModuleType)]
    listed = [(name, getattr(group, name)) for group in groups for name in group.__all__]
    full = [f"{value.__module__}.{name}" for name, value in listed if callable(value) and hasattr(value, "__module__")]
    rings: dict[str, list[str]] = {ring: [] for ring in RINGS}
    for name in full:
        rings.setdefault(name.split(".")[1], []).append(name)
    return {ring: sorted(names, key=sort_key) for ring, names in rings.items() if names}


def sort_key(full_name: str) -> tuple[bool, str]:
    """Functions first, then types, each in alphabetical order."""
    name = full_name.rsplit(".", 1)[1]
    return name[0].isupper(), name.lower()


def reference(ring: str, names: list[str]) -> str:
    """One page of reference, filled by mkdocstrings."""
    title, opening = RINGS.get(ring, (ring.capitalize(), ""))
    return f"# {title}\n\n{opening}\n\n" + "\n\n".join(f"::: {name}" for name in names) + "\n"


def with_figures(text: str) -> str:
    """The reference of `sl.plot`, each function with an example figure."""
    calls = "".join(f'sl.plot.save(sl.plot.{call}, "plot-{name}.svg")\n' for name, call in FIGURES.items())
    ran("-c", f"import sagline as sl\n{SCENE}{calls}")
    head, *functions = text.split("::: ")
    shown = [f"{head}The figures below use these objects:\n{fenced(SCENE, 'python')}"]
    for function in functions:
        name = function.strip().rsplit(".", 1)[1]
        if name not in (*FIGURES, "film", "save", "style"):
            raise PluginError(f"sl.plot.{name} has no figure in its reference; add a call to FIGURES")
        figure = f"`sl.plot.{FIGURES[name]}`:\n\n![sl.plot.{name}](plot-{name}.svg)\n" if name in FIGURES else ""
        shown.append(f"::: {function.strip()}\n\n{figure}")
    return "\n".join(shown)


def gallery(files: Files, config: MkDocsConfig) -> str:
    """Source, output and figures of every example, quickstart first, below small cards of all."""
    scripts = sorted(EXAMPLES.glob("*.py"), key=lambda script: (script.stem != "quickstart", script.stem))
    head = (
        "# Gallery\n\nThe scripts are in the folder `examples`; output and figures were made with this page. "
        "[Every command](#every-command) comes first, then every script.\n\n"
    )
    examples = [example(script, files, config) for script in scripts]
    cards = "\n".join(card for card, _ in examples)
    scripts_shown = "".join(text for _, text in examples)
    return f'{head}<div class="cards" markdown>\n{cards}\n</div>\n{every_command()}{scripts_shown}'


def example(script: Path, files: Files, config: MkDocsConfig) -> tuple[str, str]:
    """A card for one example, and the example with title, first line, figures, code and output."""
    before = set(WORK.iterdir())
    output = ran(script.name)
    source = script.read_text(encoding="utf-8")
    opening, code = source.removeprefix('"""').split('"""', 1)
    title, _, rest = re.sub(r"\s+", " ", opening).strip().removesuffix(".").partition(":")
    what = f"`{script.name}`" + (f": {rest.strip()}." if rest else "")
    figures = sorted(file for file in set(WORK.iterdir()) - before if file.suffix == ".png")
    if not figures:
        raise PluginError(f"{script.name} draws no figure for its card")
    for figure in figures:
        files.append(File.generated(config, f"gallery/{figure.name}", abs_src_path=str(figure)))
    shown = "\n\n".join(f"![{title}](gallery/{figure.name})" for figure in figures)
    card = f"[![](gallery/{figures[0].name}){{ loading=lazy }} {title}](#{script.stem})"
    text = f"\n## {title} {{ #{script.stem} }}\n\n{what}\n\n{shown}\n"
    return card, text + fenced(code.strip(), "python") + fenced(output, "text")


def command_reference() -> str:
    """The help of `sagline` and of each of its commands, with figures."""
    text = ran("-m", "typer", "sagline.cli.main", "utils", "docs", "--name", "sagline")
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    lines = [f"- [`sagline {name}`](#sagline-{name}): {first_line(command.help)}" for name, command in commands.items()]
    text = text.replace("# `sagline`\n", "# The command\n", 1)
    text = re.sub(r"\*\*Commands\*\*:\n\n(?:\* .*\n)+", "**Commands**:\n\n" + "\n".join(lines) + "\n", text)
    text = re.sub(r"^```console\n\$ ", "```\n", text, flags=re.MULTILINE)
    text = re.sub(r"^\* `--help`: .*\n", "", text, flags=re.MULTILINE)
    text = re.sub(r"\{([A-Z][\w.]*)\}", r"\1", text)  # arguments as the command's own help names them
    text = re.sub(r"^(\* `[A-Z][\w.]*) <[^>]+>`", r"\1`", text, flags=re.MULTILINE)
    for name, shown in _shown("../images/").items():
        text = re.sub(
            rf"(## `sagline {name}`\n.*?)(?=\n## |\Z)", lambda m, what=shown: f"{m[1]}\n{what}\n", text, flags=re.S
        )
    return text


def every_command() -> str:
    """Each command with its figure, page or output."""
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    shown = _shown("images/")
    if missing := commands.keys() ^ shown.keys():
        raise PluginError(f"docs/hooks/shown.py and the commands differ in {', '.join(sorted(missing))}")
    entries = (
        f"\n### {name} {{ #sagline-{name} }}\n\n{first_line(command.help)} [More](api/command.md#sagline-{name}).\n"
        f"\n{shown[name]}\n"
        for name, command in commands.items()
    )
    return "\n## Every command\n\nFigure, page or output of each command.\n" + "".join(entries)


def _shown(images: str) -> dict[str, str]:
    """Figure, page or output of each command, for a page with this path to the images."""
    return {name: text.replace("{images}", images) for name, text in SHOWN.items()}


def first_line(text: str | None) -> str:
    """The summary of a command."""
    return (text or "").strip().split("\n\n")[0].replace("\n", " ")


def fenced(text: str, language: str) -> str:
    """A block of code."""
    return f"\n```{language}\n{text.rstrip()}\n```\n"


def on_post_page(output: str, page: Any, **_: Any) -> str:
    """Check that a page loads nothing from other servers."""
    if found := LOADED.search(output):
        raise PluginError(f"{page.file.src_uri} loads a file from another server: {found[0]}")
    return output
