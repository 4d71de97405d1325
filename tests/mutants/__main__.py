"""Apply mistakes to a copy of the project, one at a time, and list the first test that detects each.

`python -m tests.mutants [FOLDER ...] [--all-tiers] [--random N]`. Each mistake is an entry of a TOML file beside this
one, or, with `--random`, a random change. A copy of the project is tested with the mistake in it, first by
the tests named in the entry and those of its folder, then by the whole first tier, then, with `--all-tiers`, by the
second. A mistake that no test detects is listed as SURVIVED.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from tests.mutants.random import changes

ROOT: Final = Path(__file__).parents[2]
COPIED: Final = ("src", "tests", "examples", "docs", "benchmarks", "tools")
FILES: Final = (
    "pyproject.toml",
    "Makefile",
    "README.md",
    "CHANGELOG.md",
    "CITATION.cff",
    "CONTRIBUTING.md",
    "mkdocs.yml",
    "LICENSE",
    ".gitignore",
)
FIRST, SECOND = "not extended and not soak", "extended and not soak"
PATIENCE: Final = 1800.0  # s for one run of the tests


class Mutant(NamedTuple):
    """One mistake.

    Attributes:
        folder: Name of the TOML file that lists it.
        file: Path below `src/sagline`.
        mistake: Description.
        old: Text that occurs exactly once in the file.
        new: Text that replaces it.
        tests: Paths of tests that run before those of the folder; they only save time.
        source: Text of the whole file with the mistake, if it is not made by replacing text.
    """

    folder: str
    file: str
    mistake: str
    old: str
    new: str
    tests: tuple[str, ...] = ()
    source: str = ""

    @property
    def path(self) -> Path:
        """Path below the root of the project."""
        return Path("src") / "sagline" / self.file


def mutants(folders: Sequence[str] = ()) -> Iterator[Mutant]:
    """All mistakes of some folders, or of all; an entry whose text is not found exactly once is an error."""
    known = sorted(file.stem for file in Path(__file__).parent.glob("*.toml"))
    if unknown := set(folders) - set(known):
        raise SystemExit(f"no mistakes are listed for {', '.join(sorted(unknown))}; choose from {', '.join(known)}")
    for listed in sorted(Path(__file__).parent.glob("*.toml")):
        if folders and listed.stem not in folders:
            continue
        for entry in tomllib.loads(listed.read_text(encoding="utf-8"))["mutant"]:
            mutant = Mutant(listed.stem, tests=tuple(entry.pop("tests", ())), **entry)
            count = (ROOT / mutant.path).read_text(encoding="utf-8").count(mutant.old)
            if count != 1 or mutant.old == mutant.new:
                raise SystemExit(f"{listed.name}: {mutant.mistake!r}: its text occurs {count} times in {mutant.file}")
            yield mutant


def chosen_at_random(count: int, seed: int) -> Iterator[Mutant]:
    """Mistakes at random places; the folder is that of the source."""
    for change in changes(ROOT / "src" / "sagline", count, seed):
        place = f"line {change.line}: {change.old} -> {change.new}"
        yield Mutant(change.file.parts[0], change.file.as_posix(), place, "", "", source=change.source)


def catching_test(copy: Path, mutant: Mutant, all_tiers: bool) -> tuple[str, str]:
    """Tier and name of the first test that fails; two empty texts if none does."""
    tests = [name for name in (*mutant.tests, f"tests/{mutant.folder}") if (copy / name.partition("::")[0]).exists()]
    runs = [("first", [name], FIRST) for name in tests] + [("first", ["--numprocesses=auto"], FIRST)]
    if all_tiers:
        runs += [("second", [name], SECOND) for name in tests] + [("second", ["--numprocesses=auto"], SECOND)]
    for tier, selected, marks in runs:
        found = failing_test(copy, [*selected, "-m", marks])
        if found:
            return tier, found
    return "", ""


def failing_test(copy: Path, arguments: Sequence[str]) -> str:
    """Name of the first test that fails in a copy; empty if all pass."""
    environment = {**os.environ, "PYTHONPATH": str(copy / "src"), "NUMBA_CACHE_DIR": str(copy / "cache")}
    environment["SAGLINE_BACKEND"] = "numba"  # compiles only the changed kernels
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-x",
        "-q",
        "--no-header",
        "-p",
        "no:cacheprovider",
        "--no-limits",
        "--ignore=tests/test_back_ends.py",  # the library has no mistake
        *arguments,
    ]
    try:
        run = subprocess.run(command, cwd=copy, env=environment, capture_output=True, text=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return "(no end)"
    if run.returncode in (0, 5):  # all passed; none selected
        return ""
    if run.returncode == 4:  # wrong arguments: a test of this name does not exist
        raise SystemExit(f"pytest does not take {' '.join(arguments)}; correct the names of the tests")
    named = re.search(r"^(?:FAILED|ERROR) (\S+)", run.stdout, re.MULTILINE)
    return named[1] if named else f"(pytest exit code {run.returncode})"


def copy_project(copy: Path) -> None:
    """Copy the project, and its compiled kernels, so that only what a mistake changes is compiled again."""
    from sagline.kernels.sources import FOLDER

    for name in COPIED:
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in FILES:
        shutil.copy(ROOT / name, copy / name)
    if FOLDER.is_dir():
        shutil.copytree(FOLDER, copy / "cache" / "kernels")


def main() -> int:
    """Command line; exit code 1 if a mistake survived."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*", help="names of TOML files; all if none is given")
    parser.add_argument(
        "--random", type=int, default=0, metavar="N", help="N random changes instead of the listed ones"
    )
    parser.add_argument("--seed", type=int, default=1, help="of the random changes")
    parser.add_argument("--all-tiers", action="store_true", help="test survivors of the first tier with the second")
    chosen = parser.parse_args()
    tally: Counter[str] = Counter()
    listed = list(chosen_at_random(chosen.random, chosen.seed) if chosen.random else mutants(chosen.folders))
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copy = Path(folder)
        copy_project(copy)
        for k, mutant in enumerate(listed):
            start, source = time.monotonic(), (ROOT / mutant.path).read_text(encoding="utf-8")
            wrong = mutant.source or source.replace(mutant.old, mutant.new)
            (copy / mutant.path).write_text(wrong, encoding="utf-8")
            tier, test = catching_test(copy, mutant, chosen.all_tiers)
            (copy / mutant.path).write_text(source, encoding="utf-8")
            tally[tier or "none"] += 1
            caught = f"{tier} tier: {test}" if tier else "SURVIVED"
            seconds = time.monotonic() - start
            print(f"{k + 1:3d}/{len(listed)} {seconds:4.0f} s  {mutant.file}: {mutant.mistake} -> {caught}", flush=True)
    print(f"{len(listed)} mistakes; caught by the first tier: {tally['first']}, by the second: {tally['second']}")
    return int(tally["none"] > 0)


if __name__ == "__main__":
    sys.exit(main())
