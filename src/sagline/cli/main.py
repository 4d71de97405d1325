"""The command `sagline`: its subcommands, their options, and help that teaches by example."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.choices import Format, Model, Tension, TensionPlace, Variable, robot_completions
from sagline.cli.terminal import reported

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

RobotArgument = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT",
        help="A preset (see `sagline robots`) or a robot file, robot.yaml.",
        autocompletion=robot_completions,
    ),
]
OutOption = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files; created if missing.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the numbers as JSON and nothing else on stdout.")]


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"sagline {version('sagline')}")
        raise typer.Exit


@app.callback(
    epilog="Exit codes: 0 fine; 1 the path cannot be followed everywhere; 2 bad input, nothing written; 130 Ctrl-C."
)
def sagline(
    show_version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Cable robots whose cables sag: from a robot and a path to proven cable lengths.

    Start here:

    ```
    sagline run                          the article's test, with its figures
    sagline robots                       the robots that come with it
    sagline show ipanema-1               all values of one of them
    sagline track cogiro my_path.yaml    a robot along a path of your own
    sagline forward cogiro lengths.csv   from measured lengths to poses
    sagline tension cogiro               every way of sharing the load of a pose
    sagline article                      the article redone, as one page
    sagline view cogiro                  drag a robot's platform in the browser
    sagline new my_robot.yaml            a robot of your own, by a few questions
    ```
    """


@app.command()
def track(
    robot: RobotArgument,
    path: Annotated[
        Path | None,
        typer.Argument(
            metavar="PATH", help="Waypoints in .yaml, or time and pose in .csv. Default: the article's path."
        ),
    ] = None,
    model: Annotated[Model, typer.Option(help="Cable model the lengths are planned with.")] = Model.CATENARY,
    tension: Annotated[Tension, typer.Option(help="How the load is shared among redundant cables.")] = Tension.CLOSEST,
    variable: Annotated[Variable, typer.Option(help="The tension in which it is shared.")] = Variable.CHORD,
    out: OutOption = Path("output"),
    figures: Annotated[bool, typer.Option("--figures/--no-figures", help="Draw figures, as PNG and SVG.")] = True,
    as_json: JsonOption = False,
) -> None:
    """Plan a robot's cable lengths along a path, and prove them with the exact cable.

    The lengths of the chosen model are wound onto exact catenaries; the position error is where the platform then
    really rests, less where it was planned. The plan is written to DIR/ROBOT-MODEL.nc.

    For example:

    ```
    sagline track article-suspended
    sagline track my_robot.yaml my_path.yaml --model empirical --out results
    sagline track cogiro my_samples.csv --no-figures --json
    ```
    """
    with reported():
        from sagline.cli.track import track as run

        code = run(robot, path, model, tension, variable, out, figures=figures, as_json=as_json)
    raise typer.Exit(code)


@app.command()
def run(out: OutOption = Path("output"), as_json: JsonOption = False) -> None:
    """Run the article's test: both simulated robots, its empirical model and the exact one, figures 18 to 22.

    Tensions are the least norm of the horizontal tensions T_x, as the article's figures show them.
    """
    with reported():
        from sagline.cli.article import run_article

        code = run_article(out, as_json=as_json)
    raise typer.Exit(code)


@app.command()
def article(
    parts: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[PART]...",
            help="figures N-M, table 2, or a chapter: feasible-sets, intercept, sag, constants, identify, models, "
            "simulation, poses, errata. Default: everything.",
        ),
    ] = None,
    out: OutOption = Path("output"),
    as_json: JsonOption = False,
) -> None:
    """Redo the article's figures, tables and errata, as one page: what it says beside what is computed.

    Writes DIR/article.html, which needs nothing else, and DIR/article.json with the numbers.

    For example:

    ```
    sagline article
    sagline article figures 6-9 --out results
    sagline article errata table 2
    ```
    """
    with reported():
        from sagline.cli.report import write_report

        write_report(out, parts or [], as_json=as_json)


@app.command()
def identify(
    file: Annotated[
        Path, typer.Argument(metavar="CSV", help="Columns span, rise, length, tension; units in brackets: span [mm].")
    ],
    length_error: Annotated[float, typer.Option(metavar="M", help="Standard error of a length [m].")] = 1e-3,
    tension_error: Annotated[float, typer.Option(metavar="N", help="Standard error of a tension [N].")] = 1.0,
    tension_at: Annotated[TensionPlace, typer.Option(help="Where the tension is measured.")] = TensionPlace.FRAME_END,
    offset: Annotated[
        bool, typer.Option("--offset/--no-offset", help="Find the zero of the lengths too, as one more unknown.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Find what a measured cable weighs and how stiff it is, and the empirical model for it.

    Standard errors and warnings say what the measurements do not determine or cannot tell apart.

    For example:

    ```
    sagline identify cable.csv
    sagline identify cable.csv --length-error 0.002 --tension-at platform-end --offset
    ```
    """
    with reported():
        from sagline.cli.identify import identify as run

        unknowns = ["linear_density", "axial_stiffness", *["length_offset"] * offset]
        run(file, length_error, tension_error, tension_at.key, unknowns, as_json=as_json)


@app.command()
def forward(
    robot: RobotArgument,
    lengths: Annotated[
        Path, typer.Argument(metavar="CSV", help="Columns L0, L1, ... and perhaps time; units in brackets: L0 [mm].")
    ],
    model: Annotated[Model, typer.Option(help="Cable model.")] = Model.CATENARY,
    out: OutOption = Path("output"),
    as_json: JsonOption = False,
) -> None:
    """Find the poses in which the platform rests on cables of measured lengths.

    The first sample needs no start; each other begins where the last one ended. Exit code 1 where a sample
    ends in no stable equilibrium.

    For example:

    ```
    sagline forward cogiro encoders.csv --out poses
    ```
    """
    with reported():
        from sagline.cli.forward import forward as run

        code = run(robot, lengths, model, out, as_json=as_json)
    raise typer.Exit(code)


@app.command()
def tension(
    robot: RobotArgument,
    pose: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z[,A,B,C]",
            help="Position [m] and angles about z, y, x [degrees]. Default: the middle of the robot's test box.",
        ),
    ] = None,
    model: Annotated[Model, typer.Option(help="Cable model.")] = Model.CATENARY,
    variable: Annotated[Variable, typer.Option(help="The tension in which the load is shared.")] = Variable.CHORD,
    out: OutOption = Path("output"),
    figures: Annotated[bool, typer.Option("--figures/--no-figures", help="Draw the polygon, as PNG and SVG.")] = True,
    as_json: JsonOption = False,
) -> None:
    """Share the load of one pose in every way, and draw the polygon of feasible tensions with all of them in it.

    For example:

    ```
    sagline tension article-mixed --pose 1,0.5,2.5
    sagline tension cogiro --pose 0,0,2,10,0,0 --variable frame_end --no-figures
    ```
    """
    with reported():
        from sagline.cli.tension import tension as run

        code = run(robot, pose, model, variable, out, figures=figures, as_json=as_json)
    raise typer.Exit(code)


@app.command()
def robots(as_json: JsonOption = False) -> None:
    """List the robots that come with sagline."""
    with reported():
        from sagline.cli.robots import list_robots

        list_robots(as_json=as_json)


@app.command()
def show(robot: RobotArgument, as_json: JsonOption = False) -> None:
    """Show every value of a robot with its unit; what its source does not give is marked, with the reason.

    For example:

    ```
    sagline show ipanema-1
    sagline show my_robot.yaml --json
    ```
    """
    with reported():
        from sagline.cli.robots import show_robot

        show_robot(robot, as_json=as_json)


@app.command()
def convert(
    source: Annotated[
        str,
        typer.Argument(
            metavar="SOURCE",
            help="A WireX file, robot.wcrfx; the folder of a CASPR robot, or its .xml; a robot file; or a preset.",
        ),
    ],
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="File to write. Default: stdout.")] = None,
    form: Annotated[
        Format, typer.Option("--format", help="A robot file in YAML, or a MuJoCo model with straight cables.")
    ] = Format.ROBOT,
    linear_density: Annotated[
        str | None, typer.Option(metavar="QUANTITY", help="Mass of all cables per length, '65 g/m' for instance.")
    ] = None,
    axial_stiffness: Annotated[
        str | None, typer.Option(metavar="QUANTITY", help="EA of all cables, '700 kN' for instance.")
    ] = None,
    cable_set: Annotated[
        str | None, typer.Option(metavar="NAME", help="CASPR: which set of cables. Default: the file's own.")
    ] = None,
    at: Annotated[
        tuple[float, float, float] | None,
        typer.Option(metavar="X Y Z", help="MuJoCo: where the platform starts, in m. Default: middle of the test box."),
    ] = None,
) -> None:
    """Convert a robot of CASPR or WireX to a robot file, or any robot to a MuJoCo model.

    What had to be assumed and what was lost is told on stderr, and stands in the robot file.

    For example:

    ```
    sagline convert robot.wcrfx --out robot.yaml
    sagline convert CASPR/my_robot --linear-density "20 g/m" --axial-stiffness "50 kN" --out my_robot.yaml
    sagline convert cogiro --format mjcf --out cogiro.xml
    ```
    """
    with reported():
        from sagline.cli.convert import convert as run

        run(source, out, form, linear_density, axial_stiffness, cable_set, at)


@app.command()
def view(
    robot: RobotArgument,
    run: Annotated[
        Path | None, typer.Argument(metavar="RUN.nc", help="A run of this robot, written by `sagline track`, to play.")
    ] = None,
    host: Annotated[
        str, typer.Option(help="Address to listen on; 0.0.0.0 is every one, for others to look.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to listen on; 0 takes any that is free.")] = 8080,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open it in a browser here.")] = True,
) -> None:
    """Look at a robot in the browser: drag its platform, and the cables follow.

    Over SSH, forward the port (`ssh -L 8080:localhost:8080 ...`) and open http://localhost:8080 at home.

    For example:

    ```
    sagline view cogiro
    sagline view my_robot.yaml --port 9000
    sagline track article-mixed --model empirical && sagline view article-mixed output/article-mixed-empirical.nc
    ```
    """
    with reported():
        from sagline.cli.view import view as serve

        code = serve(robot, run, host, port, browser=browser)
    raise typer.Exit(code)


@app.command()
def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The robot file to write, my_robot.yaml.")],
    frame: Annotated[str | None, typer.Option(help='Edges of the frame, "6 x 4 x 3 m".')] = None,
    layout: Annotated[str | None, typer.Option(help="Cables from the top, or mixed: from above and below.")] = None,
    cables: Annotated[str | None, typer.Option(help="Number of cables, 6 to 8.")] = None,
    platform: Annotated[str | None, typer.Option(help='Edges of the platform, "0.5 x 0.5 x 0.4 m".')] = None,
    mass: Annotated[str | None, typer.Option(help='Mass of the platform with its load, "30 kg".')] = None,
    rope: Annotated[
        str | None, typer.Option(help="What the cables are: dyneema-sk78, dyneema-sk62, steel-6x19, steel-7x19.")
    ] = None,
    diameter: Annotated[str | None, typer.Option(help='Diameter of the rope, "4 mm".')] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it exists.")] = False,
    look: Annotated[bool, typer.Option("--view", help="Look at it in the browser afterwards.")] = False,
) -> None:
    """Make a robot file of your own: asks for what no option says, checks it, explains it.

    For example:

    ```
    sagline new my_robot.yaml
    sagline new my_robot.yaml --frame "15 x 11 x 6 m" --mass "50 kg" --rope steel-6x19 --diameter "3 mm"
    ```
    """
    with reported():
        from sagline.cli.new import new as make
        from sagline.cli.view import serve

        answers = {
            "frame": frame, "layout": layout, "cables": cables, "platform": platform, "mass": mass, "rope": rope,
            "diameter": diameter,
        }  # fmt: skip
        machine = make(file, answers, force=force)
        code = serve(machine, None, "127.0.0.1", 8080, browser=True) if look else 0
    raise typer.Exit(code)


def app_entry() -> None:
    """Run the command; what the shell starts."""
    app(prog_name="sagline")
