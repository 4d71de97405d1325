"""`sagline examples`: the files that the commands of the documentation use."""

from __future__ import annotations

import shutil
from importlib.resources import files
from pathlib import Path
from shlex import quote

from sagline.cli.options import ForceOption, OutOption
from sagline.cli.output import Output
from sagline.cli.terminal import show_text
from sagline.core.errors import FileError
from sagline.files.writing import atomic_file, create_folder

KINDS = (".py", ".yaml", ".csv", ".wcrfx")


def examples(
    folder: OutOption = Path("sagline-examples"),
    force: ForceOption = False,
) -> None:
    """Write the files that the commands of the documentation use: a robot, a path, lengths, measurements and scripts.

    For example:

        sagline examples --out DIR
        cd DIR
        sagline track own_robot.yaml own_path.yaml
    """
    sources = example_files()
    Output(folder, "", [file.name for file in sources])  # `Outputs` raises an error if a file cannot be written
    existing = [file.name for file in sources if (folder / file.name).exists()]
    if existing and not force:
        raise FileError(folder / existing[0], "exists", "Choose another folder with --out, or replace it with --force.")
    create_folder(folder)
    for file in sources:
        with atomic_file(folder / file.name) as partial:
            shutil.copyfile(file, partial)
    show_text(f"In {folder.resolve()}: {', '.join(file.name for file in sources)}", whole=True)
    show_text(f"Try: cd {quote(str(folder))}; sagline track own_robot.yaml own_path.yaml", whole=True)


def example_files() -> list[Path]:
    """Folder of the example files: next to the installed modules, or next to the docs in the source tree."""
    inside = Path(str(files("sagline"))) / "examples"
    folder = inside if inside.is_dir() else Path(__file__).parents[3] / "examples"
    return sorted(file for file in folder.glob("*") if file.suffix in KINDS)
