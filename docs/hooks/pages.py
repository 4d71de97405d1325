"""Hooks of MkDocs: the pages that are made rather than written, so that none of them can be out of date.

The gallery runs the examples, the reference lists what `sagline.__all__` lists, the command's page is its own help.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import typer.main
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

import sagline as sl
from sagline.cli.main import app

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
WORK = ROOT / "build" / "gallery"
RINGS = {  # package -> title and opening line of its page of reference
    "cables": ("Cables", "One cable: its material, its models, its state."),
    "robot": ("Robots", "Where cables are fixed, what they carry, and where the platform is."),
    "motion": ("Motion", "Paths of the platform."),
    "kinematics": ("Kinematics", "From motion to lengths, from lengths to the pose, and the proof of a plan."),
    "tension": ("Tension", "How redundant cables share the load."),
    "statics": ("Statics", "Structure matrix, wrenches, stiffness."),
    "article": ("Identification", "Constants of cables and of the empirical model, from measurements."),
    "files": ("Files", "What is read and written."),
    "plot": ("Figures", "`sl.plot`: figures for papers, on Matplotlib."),
    "errors": ("Errors", "What sagline raises."),
}


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Complete the navigation: background pages as they stand in the folder, one page of reference for each ring."""
    nav: list[dict[str, list[str]] | str] = config.nav or []
    for section in nav:
        if isinstance(section, dict) and "Background" in section:
            written = {page for page in section["Background"] if (Path(config.docs_dir) / page).is_file()}
            section["Background"] = [page for page in section["Background"] if page in written]
    nav.append({"Reference": [f"api/{ring}.md" for ring in names_by_ring()] + ["api/command.md"]})
    config.nav = nav
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages and figures that are made here."""
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    for file in EXAMPLES.iterdir():
        if file.is_file():
            shutil.copy(file, WORK)
    files.append(File.generated(config, "gallery.md", content=gallery(files, config)))
    files.append(File.generated(config, "api/command.md", content=command_reference()))
    for ring, names in names_by_ring().items():
        files.append(File.generated(config, f"api/{ring}.md", content=reference(ring, names)))
    return files


def names_by_ring() -> dict[str, list[str]]:
    """Full names of everything public, by the package it lives in; functions of `sl.plot` among them."""
    full = [f"{value.__module__}.{name}" for name in sl.__all__ if hasattr(value := getattr(sl, name), "__module__")]
    full += [f"{getattr(sl.plot, name).__module__}.{name}" for name in sl.plot.__all__]
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


def gallery(files: Files, config: MkDocsConfig) -> str:
    """Source, output and figures of every example; quickstart first."""
    scripts = sorted(EXAMPLES.glob("*.py"), key=lambda script: (script.stem != "quickstart", script.stem))
    head = "# Gallery\n\nThe scripts are in the folder `examples`; output and figures were made with this page.\n"
    return head + "".join(example(script, files, config) for script in scripts)


def example(script: Path, files: Files, config: MkDocsConfig) -> str:
    """One example: its docstring as title and opening line, its code, what it prints, what it draws."""
    before = set(WORK.iterdir())
    output = ran([sys.executable, script.name])
    source = script.read_text(encoding="utf-8")
    opening, code = source.removeprefix('"""').split('"""', 1)
    title, _, rest = opening.removesuffix(".").partition(":")
    what = f"`{script.name}`" + (f": {rest.strip()}." if rest else "")
    text = f"\n## {title}\n\n{what}\n" + fenced(code.strip(), "python") + fenced(output, "text")
    for figure in sorted(file for file in set(WORK.iterdir()) - before if file.suffix == ".png"):
        files.append(File.generated(config, f"gallery/{figure.name}", abs_src_path=str(figure)))
        text += f"\n![{title}](gallery/{figure.name}){{ width=720 }}\n"
    return text


def command_reference() -> str:
    """The help of `sagline` and of each of its commands."""
    names = list(typer.main.get_command(app).commands)  # type: ignore[attr-defined]
    text = "# The command\n"
    for arguments in ([], *([name] for name in names)):
        title = " ".join(["sagline", *arguments])
        text += f"\n## {title}\n" + fenced(ran([sys.executable, "-m", "sagline.cli", *arguments, "--help"]), "text")
    return text


def ran(command: list[str]) -> str:
    """What a command prints; a failure stops the build."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src"), "TERMINAL_WIDTH": "88", "NO_COLOR": "1"}
    done = subprocess.run(command, cwd=WORK, env=environment, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise PluginError(f"{' '.join(command)} failed:\n{done.stderr}")
    return done.stdout


def fenced(text: str, language: str) -> str:
    """A block of code."""
    return f"\n```{language}\n{text.rstrip()}\n```\n"
