"""The gallery and the page of the command: figure, interactive page or output of each command and of each example."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import typer.main

from sagline.cli.main import app
from tools.pages.marks import EXAMPLES, ran

SHOWN: Final = {  # command -> line of marks.py; of the viewer its pictures
    "track": "drawn by: sagline track own_robot.yaml own_path.yaml --model empirical",
    "lengths": "printed by: sagline track cogiro own_path.yaml --no-figures"
    " && sagline lengths output/cogiro-catenary.nc",
    "encoder": "printed by: sagline track winches_robot.yaml own_path.yaml --no-figures"
    " && sagline encoder output/hall-winches-catenary.nc",
    "run": "drawn by: sagline run",
    "article": "drawn by: sagline article figures 6-9",
    "identify": "printed by: sagline identify cable.csv",
    "forward": "printed by: sagline forward cogiro lengths.csv",
    "tension": "drawn by: sagline tension article-mixed --pose 1,0.5,2.5",
    "vibrate": "drawn by: sagline vibrate cogiro --pose 0,0,2 --up-to 8 --axis z",
    "simulate": "drawn by: sagline simulate cogiro --break 3@0.5s --loss-time 0.001",
    "workspace": "drawn by: sagline workspace article-suspended",
    "sweep": "printed by: sagline sweep own_sweep.yaml --workers 1",
    "design": "drawn by: sagline design cogiro design.yaml --evaluations 200",
    "calibrate": "printed by: sagline calibrate winches_robot.yaml winches.csv",
    "robots": "printed by: sagline robots",
    "show": "printed by: sagline show falcon-7",
    "examples": "printed by: sagline examples --out files",
    "new": "printed by: sagline new shed.yaml",
    "convert": "printed by: sagline convert robot.wcrfx",
    "export-c": "printed by: sagline export-c cogiro",
    "export-scl": "printed by: sagline export-scl article-prototype",
    "export-fmu": "printed by: sagline export-fmu cogiro",
    "export-linuxcnc": "printed by: sagline export-linuxcnc cogiro",
    "share": "shared by: sagline simulate cogiro --break 3@0.5s --no-figures --out break.nc && sagline share break.nc",
    "twin": "printed during a run: twin",
    "control": "printed during a run: control",
    "experiment": "drawn by: sagline experiment article --in-process",
    "log": "printed during a run: log",
    "cache": "printed by: sagline cache",
}
VIEWER: Final = "![A robot in the viewer](ROOT/images/viewer.png)\n\n![A run in the viewer](ROOT/images/viewer-run.png)"
HEAD: Final = """\
# Gallery

The scripts are in the folder `examples`; output and figures were made with this page.
[Every command](#every-command) comes first, then every script.

<div class="cards" markdown>
{cards}
</div>

## Every command

Figure, page or output of each command.
"""


def gallery() -> str:
    """Every command, and source, output and figures of every example, below small cards of the examples."""
    scripts = sorted(EXAMPLES.glob("*.py"), key=lambda script: (script.stem != "quickstart", script.stem))
    cards, examples = zip(*map(_example, scripts), strict=True)
    entries = (
        f"### {name} {{ #sagline-{name} }}\n\n{summary} [More](api/command.md#sagline-{name}).\n\n{shown(name)}\n"
        for name, summary in summaries().items()
    )
    return "\n".join((HEAD.format(cards="\n".join(cards)), *entries, *examples))


def _example(script: Path) -> tuple[str, str]:
    """A card for one example, and the example with title, first line, figures, code and output."""
    opening, code = script.read_text(encoding="utf-8").removeprefix('"""').split('"""', 1)
    title, _, rest = re.sub(r"\s+", " ", opening).strip().removesuffix(".").partition(":")
    figures = re.findall(r'"(\w+\.png)"', code)
    card = f"[![](gallery/{figures[0]}){{ loading=lazy }} {title}](#{script.stem})"
    what = f"`{script.name}`" + (f": {rest.strip()}." if rest else "")
    pictures = "\n\n".join(f"![{title}](gallery/{figure})" for figure in figures)
    heading = f"## {title} {{ #{script.stem} }}\n\n{what}\n\n{pictures}"
    return card, f"{heading}\n\n```py\n{code.strip()}\n```\n\n<!-- output of: {script.name} -->\n"


def summaries() -> dict[str, str]:
    """The commands and the first paragraphs of their help."""
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    return {name: (each.help or "").strip().split("\n\n")[0].replace("\n", " ") for name, each in commands.items()}


def shown(name: str) -> str:
    """Figure, page or output of a command."""
    return VIEWER if name == "view" else f"<!-- {SHOWN[name]} -->"


def command_reference() -> str:
    """The help of `sagline` and of each of its commands, with figures."""
    text = ran(EXAMPLES, "-m", "typer", "sagline.cli.main", "utils", "docs", "--name", "sagline")
    lines = [f"- [`sagline {name}`](#sagline-{name}): {summary}" for name, summary in summaries().items()]
    text = text.replace("# `sagline`\n", "# The command\n", 1).replace("\b\n", "")  # examples are code
    text = re.sub(r"\*\*Commands\*\*:\n\n(?:\* .*\n)+", "**Commands**:\n\n" + "\n".join(lines) + "\n", text)
    text = re.sub(r"^```console\n\$ ", "```\n", text, flags=re.MULTILINE)
    text = re.sub(r"^\* `--help`: .*\n", "", text, flags=re.MULTILINE)
    text = re.sub(r"\{([A-Z][\w.]*)\}", r"\1", text)  # arguments as the command's own help names them
    text = re.sub(r"^(\* `[A-Z][\w.]*) <[^>]+>`", r"\1`", text, flags=re.MULTILINE)
    section = re.compile(r"^## `sagline (\S+)`\n(?:.|\n)*?(?=\n## |\Z)", re.MULTILINE)
    return section.sub(lambda found: f"{found[0].rstrip()}\n\n{shown(found[1])}\n", text)
