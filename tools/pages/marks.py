"""Lines of the pages that become the figures, the interactive page or the output of a command.

| line | becomes |
|---|---|
| `<!-- drawn by: sagline track cogiro -->` | figures that the command writes |
| `<!-- drawn above: name.svg -->` | figure that the page's own blocks of Python save |
| `<!-- printed by: sagline a && sagline b -->` | commands and the output of the last one |
| `<!-- printed during a run: twin -->` | output of `sagline twin`, or `control` or `log`, during a run of a machine |
| `<!-- shared by: sagline a && sagline share b -->` | page that the last command writes, in a frame |
| `<!-- output of: quickstart.py -->` | output of an example; its pictures are copied |

Each runs in a folder of its own with the files of the examples and of the page (`<!-- file: name -->`). `ROOT/` in a
link of the new text is the folder of all pages.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from hashlib import sha256
from html import escape, unescape
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[2]
EXAMPLES: Final = ROOT / "examples"
PAGES: Final = ROOT / "build" / "pages"
WORK: Final = ROOT / "build" / "work"
MARK: Final = re.compile(
    r"^<!-- (drawn by|printed by|printed during a run|shared by|output of): (.+?) -->$", re.MULTILINE
)
ABOVE: Final = re.compile(r"^<!-- drawn above: ((\S+)\.svg) -->$", re.MULTILINE)
NAMESPACE: Final = 'xmlns="http://www.w3.org/2000/svg"'
MOST: Final = 24  # largest number of printed lines
PATIENCE: Final = 600.0  # s, for one command
TERMINATED: Final = 143  # exit code
PLCS: Final = "127.0.0.1:11021,127.0.0.1:11022,127.0.0.1:11023,127.0.0.1:11024"
TWIN: Final = "sagline twin article-prototype --port 0"
CONTROL: Final = "sagline control article-prototype --log driven.mcap"
# the machine runs in the same process without a real-time clock, because the build computer may be busy
IN_PROCESS: Final = """\
import sagline as sl
from sagline.cli import control, main
from sagline.control import real_time
control._link = lambda robot, plc, modbus: sl.twin.Machine(robot, seed=1).link()
real_time.Pace = lambda: None
main.app({words!r})
"""
DRIVEN: Final = "home 0,0,1.5\ngoto 0.1,-0.2,1.4\njog 3 +5mm\noff\n"


def folder_for(job: str, files: dict[str, str]) -> Path:
    """A new folder with the files of the examples and these files."""
    folder = WORK / sha256(job.encode()).hexdigest()[:8]
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(EXAMPLES, folder)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def started(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    """Python with these arguments, on one core and without colors; it imports this tree."""
    paths = {"PYTHONPATH": f"{ROOT / 'src'}{os.pathsep}{ROOT}", "NO_COLOR": "1", "OPENBLAS_NUM_THREADS": "1"}
    command, pipe = [sys.executable, *arguments], subprocess.PIPE
    return subprocess.Popen(
        command, cwd=folder, env={**os.environ, **paths}, text=True, stdin=pipe, stdout=pipe, stderr=pipe
    )


def ran(folder: Path, *arguments: str, answers: str = "") -> str:
    """Output of Python with these arguments and this standard input."""
    return output_of(started(folder, *arguments), answers)


def output_of(process: subprocess.Popen[str], answers: str = "", code: int = 0) -> str:
    """The output of a program at its end; another exit code stops the build."""
    output, errors = process.communicate(answers, PATIENCE)
    if process.returncode != code:
        raise RuntimeError(f"{process.args!r} ended with {process.returncode}:\n{errors}")
    return output


def commanded(folder: Path, *lines: str, answers: str = "") -> str:
    """Output of the last of these commands."""
    return [ran(folder, "-m", "sagline.cli", *shlex.split(line)[1:], answers=answers) for line in lines][-1]


def shown_above(page: str, folder: Path) -> str:
    """A page as executed, with the figures that its own blocks of Python save."""
    (folder / "page.md").write_text(page, encoding="utf-8")
    page = ran(folder, "-m", "tools.pages.snippets", "page.md")
    for name, _ in ABOVE.findall(page):
        _copy(folder / name, f"pictures/{name}")
    return ABOVE.sub(r"![\2](ROOT/pictures/\1)", page)


def drawn(command: str, folder: Path) -> str:
    """The figures of a command in the order of writing, as SVG, and films as GIF."""
    out = folder / "out"
    commanded(folder, f"{command} --out {'out/sim.nc' if ' simulate ' in command else 'out'}")
    for page in out.glob("*.html"):  # of a report the first drawing
        found = re.search(r"<svg\b.*?</svg>", page.read_text(encoding="utf-8"), re.DOTALL)
        if found:
            text = found[0] if NAMESPACE in found[0] else found[0].replace("<svg", f"<svg {NAMESPACE}", 1)
            page.with_suffix(".svg").write_text(text, encoding="utf-8")
    written = sorted([*out.glob("*.svg"), *out.glob("*.gif")], key=lambda file: file.stat().st_mtime_ns)
    if not written:
        raise RuntimeError(f"{command} drew nothing")
    return "\n\n".join(f"![{command}](ROOT/{_copy(file, f'pictures/{folder.name}-{file.name}')})" for file in written)


def _copy(file: Path, address: str) -> str:
    """The address of a new file among the pages."""
    (PAGES / address).parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(file, PAGES / address)
    return address


def output_of_example(script: str, folder: Path) -> str:
    """The output of an example, whose pictures are copied."""
    output = ran(folder, script)
    for file in folder.glob("*.png"):
        _copy(file, f"gallery/{file.name}")
    return f"```text\n{output.rstrip()}\n```"


def shared(commands: str, folder: Path) -> str:
    """The page of the last command in a frame; it loads when the reader scrolls near it, without other servers."""
    *before, last = commands.split(" && ")
    commanded(folder, *before, f"{last} --out shared.html")
    address = _copy(folder / "shared.html", f"shared/{folder.name}.html")
    content = (folder / "shared.html").read_bytes()
    found = re.search(r"<title>(.*?)</title>", content.decode())
    title = escape(unescape(found[1]) if found else last)
    return (
        f'<iframe class="shared" src="ROOT/{address}" loading="lazy" title="{title}, interactive">'
        f"</iframe>\n\n*Made by `{last}`, {len(content) / 1e3:,.0f} kB.* "
        f"[Open as a separate page](ROOT/{address})"
    )


def printed(commands: str, folder: Path) -> str:
    """Commands and the output of the last one."""
    lines = commands.split(" && ")
    return terminal(lines, commanded(folder, *lines, answers="\n" * 9), folder)


def printed_during_run(what: str, folder: Path) -> str:
    """The output of a starting twin, of a controller with piped commands, or of its log."""
    if what == "twin":
        process, found = started(folder, "-m", "sagline.cli", *shlex.split(TWIN)[1:]), []
        for line in process.stdout or ():
            found.append(line)
            if "Ctrl-C" in line:
                process.terminate()  # a background shell has it ignore SIGINT
        return terminal([TWIN], "".join(found) + output_of(process, code=TERMINATED), folder)
    words = [*shlex.split(CONTROL)[1:], "--plc", PLCS]
    driven = ran(folder, "-c", IN_PROCESS.format(words=words), answers=DRIVEN)
    if what == "control":
        return terminal([f"{CONTROL} \\\n    --plc {PLCS}"], driven, folder)
    return printed("sagline log driven.mcap", folder)


def terminal(commands: list[str], text: str, folder: Path) -> str:
    """Commands and the output of the last one, cut after `MOST` lines."""
    lines = [line.rstrip() for line in text.replace(str(folder), "~").strip("\n").splitlines()]
    if len(lines) > MOST:
        lines = [*lines[:MOST], f"… and {len(lines) - MOST:,} more lines"]
    return "\n".join(("```text", *(f"$ {line}" for line in commands), *lines, "```"))


MADE: Final[dict[str, Callable[[str, Path], str]]] = {
    "drawn by": drawn,
    "printed by": printed,
    "printed during a run": printed_during_run,
    "shared by": shared,
    "output of": output_of_example,
}
