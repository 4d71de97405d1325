"""The command `sagline`; each subcommand is imported only when it is needed."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib import import_module
from importlib.metadata import version
from inspect import cleandoc, signature
from itertools import chain
from pathlib import Path
from typing import Annotated, Any, cast

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command_from_info
from typer.models import CommandInfo

from sagline.cli.ending import exit_code_of
from sagline.cli.options import Condition, expanded
from sagline.core.errors import InvalidValueError
from sagline.files.writing import finished_files

GROUPS = {  # the subcommands in the order in which the help lists them
    "Robots": ("robots", "show", "new", "convert", "design", "calibrate", "identify"),
    "Lengths and tensions": ("track", "lengths", "encoder", "forward", "tension"),
    "Motion and workspace": ("simulate", "vibrate", "workspace", "sweep"),
    "Pages": ("view", "share"),
    "Machines": ("control", "twin", "log", "export-c", "export-scl", "export-fmu", "export-linuxcnc"),
    "The article": ("run", "article", "experiment"),
    "Installation": ("examples", "cache"),
}
NAMES = tuple(chain.from_iterable(GROUPS.values()))
MODULES = {  # modules of the subcommands whose module has another name
    "show": "robots",
    "encoder": "lengths",
    "forward": "lengths",
    "twin": "control",
    "export-c": "convert",
    "export-scl": "convert",
    "export-fmu": "convert",
    "export-linuxcnc": "convert",
    "run": "article",
    "experiment": "article",
    "examples": "installation",
    "cache": "installation",
}
FORMER = {  # former names of options, by command; they remain valid
    "convert": {"--format": "--kind"},
    "log": {"--plan": "--plan-number"},
    "vibrate": {"--force": "--axis"},
    "workspace": {"--wrench": "--loads"},
}
DEBUG = "--debug"
HYPHEN = "\N{NON-BREAKING HYPHEN}"
MOST_NAMES = 6  # largest number of files listed after an error
START = """\
Cable robots with sagging cables: plan cable lengths for a path, and prove that they are feasible.

Start here:

    sagline run                         the article's test, with its figures
    sagline show cogiro                 all values of a robot
    sagline track cogiro                a plan of cable lengths along a path
    sagline view cogiro                 the robot in the browser, to be dragged
    sagline examples --out DIR          files to try all commands with
    sagline new my_robot.yaml           your own robot file
"""


class _Formatter(cast(Any, typer.Context.formatter_class)):  # type: ignore[misc]
    """Formatter of help texts. It does not break lines at the hyphens of names."""

    def write_dl(self, rows: Sequence[tuple[str, str]], *more: Any, **extra: Any) -> None:
        super().write_dl([(name, text.replace("-", HYPHEN)) for name, text in rows], *more, **extra)

    def write_text(self, text: str) -> None:
        super().write_text(text.replace("-", HYPHEN))

    def getvalue(self) -> str:
        """The help text, in which usual hyphens replace non-breaking hyphens."""
        return str(super().getvalue()).replace(HYPHEN, "-")


class _Command(TyperCommand):
    """A subcommand. It rejects empty arguments and options without effect. Its help shows arguments without braces."""

    conditions: Mapping[str, Sequence[Condition]]  # for each parameter, other options that must be given or missing

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse `args`. Empty texts are rejected, because an empty path would mean the current folder."""
        former = FORMER.get(self.name or "", {})
        args = [former.get(name, name) + sign + value for name, sign, value in (arg.partition("=") for arg in args)]
        if not ctx.resilient_parsing:  # the shell uses resilient parsing to complete words
            given, _, _ = self.make_parser(ctx).parse_args(args=list(args))
            parameter: Any  # typer has its own class of parameters
            for parameter in self.get_params(ctx):
                value = given.get(parameter.name or "")
                for text in value if isinstance(value, list | tuple) else (value,):
                    if isinstance(text, str) and not text.strip():
                        raise typer.BadParameter(f"it is empty. Give {parameter.metavar}.", ctx, parameter)
            self._check_conditions(given)
        return super().parse_args(ctx, args)

    def _check_conditions(self, given: Mapping[str, Any]) -> None:
        """Reject an option in `given` that has no effect, because another option is missing or given."""
        by_label: dict[str, Any] = {_label(parameter): parameter for parameter in self.params}
        for label, parameter in by_label.items():
            is_given = given.get(parameter.name) is not None
            for name, needed in self.conditions.get(parameter.name, ()) if is_given else ():
                other = by_label[name]
                if (given.get(other.name, other.default) in (None, False)) == needed:
                    word, allowed = ("without", "both") if needed else ("with", "only one of the two")
                    step = f"Add {name}, or leave out {label}." if needed else f"Leave out {label}, or {name}."
                    raise InvalidValueError(label, f"given {word} {name}", allowed, step)

    def get_help(self, ctx: Any) -> str:
        ctx.formatter_class = _Formatter
        usage, _, rest = super().get_help(ctx).partition("\n\n")
        argument = r"^(  [A-Z.\[\]]\S*) <([^>]+)>"
        rest = re.sub(argument, lambda found: found[1].ljust(len(found[0])), rest, flags=re.MULTILINE)
        return f"{re.sub(r'[{}]', '', usage)}\n\n{rest}"


class _Commands(Mapping[str, _Command]):
    """The subcommands by name. Reading a subcommand imports its module."""

    def __getitem__(self, name: str) -> _Command:
        if name not in NAMES:
            raise KeyError(name)
        return _load_command(name)

    def __iter__(self) -> Iterator[str]:
        return iter(NAMES)

    def __len__(self) -> int:
        return len(NAMES)


class _Group(TyperGroup):
    """The group of the subcommands. It turns an error of a subcommand into one line and an exit code."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands: Any = _Commands()

    def get_help(self, ctx: Any) -> str:
        ctx.formatter_class = _Formatter
        return str(super().get_help(ctx))

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        wide = max(map(len, NAMES))
        for title, names in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(name.ljust(wide), self.commands[name].short_help) for name in names])

    def main(self, args: Sequence[str] | None = None, *more: Any, **extra: Any) -> Any:
        """Run a subcommand; `--debug` may be at any place."""
        words = (sys.argv[1:] if args is None else list(args)) or ["--help"]
        debug, words = DEBUG in words, [word for word in words if word != DEBUG]
        alone = extra.pop("standalone_mode", True)

        def command() -> Any:
            from sagline.cli.terminal import notices

            with notices(), finished_files() as finished:
                try:
                    return super(_Group, self).main(words, *more, **{**extra, "standalone_mode": False})
                except Exception as error:
                    if finished:
                        error.add_note(_before(finished))
                    raise

        return sys.exit(exit_code_of(command, debug=debug)) if alone else command()


app = typer.Typer(
    cls=_Group,
    no_args_is_help=True,
    rich_markup_mode=None,  # plain help has no colors, and the same words at every width
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@cache
def _load_command(name: str) -> _Command:
    """Import a subcommand, and read its options from the signature of its function."""
    function = getattr(import_module(f"sagline.cli.{MODULES.get(name, name)}"), name.replace("-", "_"))
    text, call = _help(function.__doc__), expanded(function)
    info = CommandInfo(name=name, cls=_Command, callback=call, help=text, short_help=text.partition("\n\n")[0])
    made: Any = get_command_from_info(info, pretty_exceptions_short=False, rich_markup_mode=None)
    made.conditions = {each.name: each.default.conditions for each in signature(call).parameters.values()}
    return cast(_Command, made)


def _label(parameter: Any) -> str:
    """Name of an option or argument for the user: "--prove", "PATH"."""
    return str(parameter.opts[0] if parameter.param_type_name == "option" else parameter.metavar)


def _before(finished: Sequence[Path]) -> str:
    """Note that names the files in `finished`, which were complete before an error."""
    names = ", ".join(file.name for file in finished[:MOST_NAMES])
    more = f" and {len(finished) - MOST_NAMES} more" if len(finished) > MOST_NAMES else ""
    return f"Complete files before the error: {names}{more} in {finished[0].parent}"


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"sagline {version('sagline')}")
        raise typer.Exit


def _help(text: str | None) -> str:
    """A docstring as help text. The lines of an indented paragraph are not joined."""
    paragraphs = cleandoc(text or "").split("\n\n")
    return "\n\n".join(f"\b\n{paragraph}" if paragraph.startswith(" ") else paragraph for paragraph in paragraphs)


@app.callback(
    help=_help(START),
    epilog="Exit codes: 0 success; 1 the path is not feasible everywhere; 2 bad input, nothing written; "
    "70 a mistake in sagline; 130 Ctrl-C, 143 SIGTERM, 129 SIGHUP.",
)
def sagline(
    show_version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
    show_debug: Annotated[
        bool, typer.Option(DEBUG, help="Show the traceback of an error; allowed after a command too.")
    ] = False,
) -> None:
    """Define the options of all subcommands."""
