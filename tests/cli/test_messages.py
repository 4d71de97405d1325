"""Messages of the command line on typical mistakes, compared with a snapshot that `make messages` renews.

Only these tests compare whole sentences; other tests compare exit codes, files and numbers.
"""

from __future__ import annotations

import os
import shlex
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from sagline.files.mcap_writer import Recorder
from tests.calibration.made_up import made_up
from tests.files.executions import execution
from tests.kinematics.winches import wound
from tests.tiers import extended

EXAMPLES = Path(__file__).parents[2] / "examples"
ROBOT = (EXAMPLES / "own_robot.yaml").read_text(encoding="utf-8")
SWEEP = (EXAMPLES / "own_sweep.yaml").read_text(encoding="utf-8")
DESIGN = (EXAMPLES / "design.yaml").read_text(encoding="utf-8")
PATH = "durations: 1\nrate: 4\nwaypoints: [{position: [0, 0, 1.5]}, {position: [1, 0, 1.5]}]\n"
SAMPLES = "time,x,y,z\n0,0,0,1.5\n0.5,0,0,1.5\n1,0.2,0,1.5\n"
HEADER = ",".join(f"L{k}" for k in range(8))
LENGTHS = f"{HEADER}\n9,9,9,9,9,9,9,9\n"
COUNTS = HEADER.replace("L", "C") + "\n1,1,1,1,1,1,1,1\n"
WIREX = """<models version="0.32"><robot name="swing" motionpattern="3T"><geometry>
<chain><base x="-1" y="-1" z="2" radius="0.02" a13="1" a31="-1" a33="0"/><platform x="0" y="0" z="0"/></chain>
<chain><base x="1" y="-1" z="2" radius="0.02"/><platform x="0" y="0" z="0"/></chain>
<chain><base x="0" y="1" z="2" radius="0.02"/><platform x="0" y="0" z="0"/></chain>
</geometry><platform mass="3"/></robot></models>"""

FILES = {
    # robots
    "mass.yaml": ROBOT.replace("mass: 12 kg", "mass: -12 kg"),
    "density.yaml": ROBOT.replace("10 g/m", "10 g"),
    "inertia.yaml": ROBOT.replace("box: [30 cm, 30 cm, 40 cm]", "box: [30 cm, 30 cm]"),
    "limits.yaml": ROBOT.replace("tension_max: 600 N", "tension_max: 6 N"),
    "misspelt.yaml": ROBOT.replace("tension_min", "tension_mim"),
    "unnamed.yaml": ROBOT.replace("mass: 12 kg\n", ""),
    "seven.yaml": ROBOT.replace("  - [6, -4, 5]\n", "", 1),
    "broken.yaml": ROBOT.replace("cables: #", "cables: {"),
    "empty.yaml": "",
    "list.yaml": "[1, 2, 3]\n",
    # paths
    "path.txt": PATH,
    "path.yaml": PATH,
    "mm.yaml": PATH.replace("[1, 0, 1.5]", "[2500, 0, 1500]"),
    "mm.csv": SAMPLES.replace("0.2,0,1.5", "2500,0,1500"),
    "beyond.yaml": PATH.replace("[1, 0, 1.5]", "[1.1e6, 0, 1.5]"),
    "beyond.csv": SAMPLES.replace("0.2", "1100000"),
    "huge.yaml": PATH.replace("[1, 0, 1.5]", "[-1e30, 0, 1.5]"),
    "huge.csv": SAMPLES.replace("1.5", "-2e7"),
    "flat.yaml": PATH.replace("[1, 0, 1.5]", "[1, 0]"),
    "single.yaml": PATH.replace(", {position: [1, 0, 1.5]}", ""),
    "brief.yaml": PATH.replace("durations: 1", "durations: 0.001"),
    "untimed.yaml": PATH.replace("durations: 1\n", ""),
    "columns.csv": SAMPLES.replace("time,x,y,z", "time,x,y,w"),
    "order.csv": SAMPLES.replace("0.5,", "2,"),
    "words.csv": SAMPLES.replace("0.2", "left"),
    "outside.yaml": PATH.replace("[1, 0, 1.5]", "[7.2, 3, 1.5]"),
    # lengths, counts and measurements
    "two_lengths.csv": "L0,L1\n1,2\n",
    "negative.csv": LENGTHS.replace("9", "-2", 1),
    "nan.csv": LENGTHS.replace("9", "nan", 1),
    "l8.csv": LENGTHS.replace("L7", "L8"),
    "weights.csv": LENGTHS.replace("L0", "L0 [kg]"),
    "header.csv": f"{HEADER}\n",
    "times.csv": f"time,{HEADER}\n1,9,9,9,9,9,9,9,9\n1,9,9,9,9,9,9,9,9\n",
    "lengths.csv": LENGTHS,
    "counts.csv": COUNTS,
    "full.csv": COUNTS + "0,0,0,9e9,0,0,0,0\n",
    "timed.csv": "time [s],C7,L0\n1,2,3\n",
    "short.csv": LENGTHS.replace("9", "2"),
    "cable.csv": "span,rise\n1,2\n",
    # others
    "swing.wcrfx": WIREX,
    "goal.yaml": DESIGN.replace("workspace_share", "volume"),
    "unit.yaml": DESIGN.replace("low: -2 m", "low: -2 kg", 1),
    "sweep.yaml": SWEEP.replace("force_x", "force_w"),
    "cogiro.html": "<p>my notes",
    "text.mcap": "no log at all",
    "empty.mcap": "",
    "cut.mcap": "\x00",
}

# exit code and command line
FIRST_TIER = """
2 trak cogiro
2 --versoin
2 track
2 track article-suspnded
2 track missing.yaml
2 track cogiro missing.csv
2 track cogiro path.txt
2 track cogiro path.yaml --out path.yaml/out
2 track cogiro path.yaml --rate 5
2 track cogiro path.yaml more
2 track cogiro path.yaml --model rope
2 track cogiro path.yaml --model Straight
2 track cogiro path.yaml --tension minimum_norm
2 track cogiro path.yaml --wrench 1,2
2 track cogiro path.yaml --payload
2 track cogiro path.yaml --payload -5
2 track cogiro ''
2 track cogiro path.yaml --out ''
2 track cogiro anchor.yaml
2 track cogiro mm.yaml
2 track cogiro mm.csv
2 track cogiro beyond.yaml
2 track cogiro beyond.csv
2 track cogiro huge.yaml
2 track cogiro huge.csv
2 track cogiro flat.yaml
2 track cogiro single.yaml
2 track cogiro brief.yaml
2 track cogiro untimed.yaml
2 track cogiro columns.csv
2 track cogiro order.csv
2 track cogiro words.csv
2 show nothing
2 show ''
2 show mass.yaml
2 show density.yaml
2 show inertia.yaml
2 show limits.yaml
2 show misspelt.yaml
2 show unnamed.yaml
2 show seven.yaml
2 show broken.yaml
2 show empty.yaml
2 show list.yaml
2 show path.yaml
2 lengths missing.nc
2 lengths cut.nc
2 lengths sim.nc
2 lengths run.nc --out run.nc
2 encoder unhomed.nc
2 encoder missing.nc
1 encoder fast.nc
2 encoder wound.nc --out wound.nc
2 encoder wound.nc --winding loose
2 forward cogiro two_lengths.csv
2 forward cogiro negative.csv
2 forward cogiro nan.csv
2 forward cogiro l8.csv
2 forward cogiro weights.csv
2 forward cogiro header.csv
2 forward cogiro times.csv
2 forward cogiro counts.csv
2 forward cogiro timed.csv
2 forward cogiro counts.csv --counts
2 forward wound.yaml lengths.csv --counts
2 forward wound.yaml full.csv --counts
1 forward cogiro short.csv
2 article errata ' '
2 article --out=
2 identify cable.csv
2 identify missing.csv
2 tension cogiro --pose 1,2
2 tension cogiro --wrench 1,2,nan
2 tension cogiro --wrench 1,2,1e308
2 tension cogiro --payload '5 m'
2 tension cogiro --payload inf
2 tension cogiro --variable foo
2 tension cogiro --variable frame-end
2 tension own_robot.yaml
2 tension five.yaml --no-figures
1 tension article-suspended --pose 7.45,0,1.5
1 tension article-suspended --pose 0,0,2 --wrench 0,0,-30000
2 vibrate cogiro --up-to 0
2 vibrate cogiro --up-to '3 kg'
2 vibrate cogiro --up-to 1e5
2 vibrate cogiro --damping 2
2 vibrate cogiro --damping '% 1'
2 vibrate cogiro --film 99999
2 vibrate cogiro --map 3x2
2 vibrate cogiro --map 0x1x1
2 vibrate cogiro --map 9999x9999x9
2 vibrate cogiro --map 2x2x2 --pose 0,0,1.5
2 vibrate cogiro --map 2x2x2 --film 1
1 vibrate article-suspended --pose 7.45,0,1.5
2 simulate cogiro --break 9@1s
2 simulate cogiro --break 3
2 simulate cogiro --break 3@1kg
2 simulate cogiro --out sim.txt
2 simulate cogiro --step 1
2 simulate cogiro --shaper zvd
2 simulate cogiro --cable-mass modal --break 3@1s
2 simulate cogiro path.yaml --after -1
2 workspace cogiro --wrench +-100
2 workspace cogiro --wrench '+-1 N, +-2 N'
2 workspace cogiro --wrench '1 N, +-2 N'
2 workspace cogiro --wrench '+-5 kg'
2 workspace cogiro --box 1..2,3
2 workspace cogiro --box 2..1,0..1,0..1
2 workspace cogiro --box '0..1, 0..1, 0..1 kg'
2 workspace cogiro --box 0..0,0..0,0..1
2 workspace cogiro --tilt 10
2 workspace cogiro --tilt '10 N'
2 workspace cogiro --max-sag 0
2 workspace cogiro --cells 3
2 workspace cogiro --scene path.yaml
2 sweep sweep.yaml
2 sweep own_sweep.yaml --workers 0
2 sweep own_sweep.yaml --workers 2 --scheduler tcp://a:1
2 sweep own_sweep.yaml --scheduler a:1
2 design own_robot.yaml missing.yaml
2 design own_robot.yaml goal.yaml
2 design own_robot.yaml unit.yaml
2 design own_robot.yaml design.yaml --evaluations 3
2 design own_robot.yaml design.yaml --evaluations many
2 calibrate winches_robot.yaml
2 calibrate winches_robot.yaml missing.csv
2 calibrate winches_robot.yaml winches_robot.yaml
2 calibrate winches_robot.yaml silent.csv
2 calibrate winches_robot.yaml winches.csv --plan 5
2 calibrate winches_robot.yaml --plan 0
2 calibrate winches_robot.yaml --plan 5 --plot a.png
2 calibrate winches_robot.yaml --plan 5 --out poses.nc
2 calibrate winches_robot.yaml --plan 5 --tension-deviation '5 mm'
2 calibrate winches_robot.yaml --plan 5 --seed -1
2 calibrate winches_robot.yaml winches.csv --out winches_robot.yaml
2 calibrate winches_robot.yaml winches.csv --plot found.nc
2 calibrate winches_robot.yaml winches.csv --unknowns length_zeros
2 calibrate winches_robot.yaml winches.csv --unknowns mass,mass
2 calibrate winches_robot.yaml winches.csv --unknowns mass,
2 calibrate winches_robot.yaml winches.csv --unknowns measuring_frame
2 calibrate winches_robot.yaml winches.csv --length-deviation 0
2 calibrate winches_robot.yaml winches.csv --folds -1
2 calibrate winches_robot.yaml winches.csv --folds 1
2 examples --out path.yaml
2 new mine.yaml
2 new mine.yaml --layout bottom
2 new mine.yaml --cables 9
2 new mine.yaml --cables some
2 new mine.yaml --diameter 3
2 new mine.yaml --diameter '3 kg'
2 new mine.yaml --mass '0 kg'
2 new mine.yaml --mass ''
2 new mine.yaml --mass '9 t' --diameter '1 mm'
2 new mine.yaml --frame '3 x 2'
2 new mine.yaml --frame '3 x 2 x -1 m'
2 new mine.yaml --platform '7 x 1 x 1 m'
2 new mine.yaml --rope string
2 new path.yaml
2 convert missing.wcrfx
2 convert folder
2 convert swing.wcrfx --out swing.wcrfx
2 convert swing.wcrfx --out swing.txt
2 convert swing.wcrfx --out swing.yaml --format mjcf
2 convert swing.wcrfx --linear-density '20 g/m'
2 convert swing.wcrfx --linear-density '20 g' --axial-stiffness 1
2 convert swing.wcrfx --linear-density -1 --axial-stiffness 1
2 convert swing.wcrfx --format mjcf
2 convert swing.wcrfx --format mjcf --at 9 9 9
2 convert swing.wcrfx --cable-set a
2 convert cogiro --at 1 '' 2
2 convert cogiro --out ''
2 convert cogiro --at 1 2 3
2 export-c cogiro --out c.h
2 export-scl cogiro
2 export-fmu cogiro --out c.zip
2 export-fmu cogiro --winches robot
2 export-linuxcnc cogiro --out c.h
2 export-linuxcnc cogiro --out Kins.c
2 view nothing-like-it --no-browser
2 view cogiro missing.nc --no-browser
2 view cogiro --port 99999 --no-browser
2 view cogiro --clients 0 --no-browser
2 view cogiro --allow-host http://lab.example --port 0 --no-browser
2 view cogiro --mode 0 --no-browser
2 view cogiro --mode 'light 1' --no-browser
2 view cogiro --mode 1 run.nc --no-browser
2 view cogiro --payload '5 m' --no-browser
2 view cogiro --wrench 1,2 --no-browser
2 view cogiro run.nc --payload 5 --no-browser
2 view fast sim.nc --no-browser
2 view cogiro --beside run.nc --no-browser
2 view found.nc --beside run.nc --no-browser
2 view article-mixed found.nc --no-browser
2 view found.nc --pose 0,0,2 --no-browser
2 view found.nc --live --no-browser
2 view cut.nc --no-browser
2 view missing.nc --no-browser
2 view missing.mcap --no-browser
2 view cogiro --live --no-browser
2 view cogiro --truth run.mcap --no-browser
2 view cogiro run.mcap --no-browser
2 view run.mcap --pose 0,0,1 --no-browser
2 view twin.mcap --no-browser
2 share cogiro
2 share cogiro --out cogiro.pdf
2 share missing.nc
2 share cut.mcap
2 twin nobody
2 twin cogiro
2 twin article-prototype --port 65536
2 twin article-prototype --port -1
2 twin article-prototype --port 65534
2 twin article-prototype --host 192.0.2.1 --port 0
2 twin article-prototype --seed x
2 twin article-prototype --fault 'cell 3 stucks'
2 twin article-prototype --fault 'cell 8 sticks'
2 twin article-prototype --true cogiro
2 control article-prototype
2 control article-prototype --plc 127.0.0.1:1
2 control article-prototype --plc 127.0.0.1:1,127.0.0.1:2,127.0.0.1:3,127.0.0.1:x
2 experiment artikle --in-process
2 experiment article --in-process --true falcon-7
2 experiment article --in-process --true cogiro
2 experiment article --in-process --true missing.yaml
2 experiment article --in-process --seed x
2 experiment article --in-process --out /dev/null/x
2 log missing.mcap
2 log run.mcap --plan 1
2 log run.mcap --plan x
2 log run.mcap --to run.csv
2 log run.nc
2 log .
2 log empty.mcap
2 log text.mcap
0 log killed.mcap
"""
SECOND_TIER = """
2 article figure 99
1 track cogiro outside.yaml --no-figures
2 share one.nc
2 lengths nowhere.nc
2 encoder run.nc
2 view fast run.nc --no-browser
2 control article-prototype --plc 127.0.0.1:1,127.0.0.1:2,127.0.0.1:3,127.0.0.1:4
"""


def lines(text: str) -> list[tuple[int, str]]:
    """Exit codes and command lines of a table."""
    return [(int(line[0]), line[2:]) for line in text.splitlines() if line]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the files that the commands read."""
    folder = tmp_path_factory.mktemp("mistakes")
    for name in ("own_robot.yaml", "own_planar.yaml", "own_sweep.yaml", "design.yaml", "winches_robot.yaml"):
        shutil.copy(EXAMPLES / name, folder)
    log = (EXAMPLES / "winches.csv").read_text(encoding="utf-8")
    texts = {
        "winches.csv": log,
        "silent.csv": "".join(line for line in log.splitlines(True) if not line.startswith("#")),
    }
    cogiro = sl.load_robot("cogiro")
    end = (cogiro.frame_anchors[0] - cogiro.platform_anchors[0]).tolist()
    texts["anchor.yaml"] = PATH.replace("[1, 0, 1.5]", str(end))
    texts["wound.yaml"] = sl.dump_robot(wound())
    texts["five.yaml"] = sl.dump_robot(sl.without_cables(sl.load_robot("article-mixed"), 0, 1, 2))
    for name, text in (FILES | texts).items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "folder").mkdir()
    path = sl.load_path(folder / "path.yaml")
    plan = sl.inverse(cogiro, path)
    plan.save(folder / "run.nc")
    (folder / "cut.nc").write_bytes((folder / "run.nc").read_bytes()[:3000])
    sl.inverse(cogiro, path.pose[0]).save(folder / "one.nc")
    outside = sl.Pose([[7.4, 5.4, 0.1]] * 2, [np.eye(3)] * 2)
    sl.inverse(sl.load_robot("article-suspended"), outside).save(folder / "nowhere.nc")
    sl.inverse(wound(), path).save(folder / "wound.nc")
    sl.inverse(wound(length_zero=None), path).save(folder / "unhomed.nc")
    sl.inverse(wound(speed_limit=150.0, torque_limit=1.7, inertia=1e-4), path).save(folder / "fast.nc")
    sl.simulate(sl.inverse(cogiro, path.pose[0]).state, duration=0.05).save(folder / "sim.nc")
    made_up(count=6).save(folder / "found.nc")
    execution().save(folder / "run.mcap")
    (folder / "killed.mcap").write_bytes((folder / "run.mcap").read_bytes()[:-20_000])
    with Recorder(folder / "twin.mcap", execution().robot) as recorder:
        recorder.truth(0.0, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    return folder


@pytest.fixture
def folder(files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Current folder with links to all the files."""
    for file in files.iterdir():
        if file.is_file():
            os.link(file, tmp_path / file.name)
    (tmp_path / "folder").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    return tmp_path


@pytest.mark.parametrize(
    ("code", "line"),
    [*lines(FIRST_TIER), *(pytest.param(*each, marks=extended) for each in lines(SECOND_TIER))],
    ids=[line for _, line in lines(FIRST_TIER) + lines(SECOND_TIER)],
)
def test_message(code: int, line: str, folder: Path, snapshot: Any) -> None:
    """Exit code and stderr agree with the snapshot; a command that ends with 2 prints one line and writes no file."""
    before = sorted(folder.rglob("*"))
    enough_for_new = "\n" * 6  # an option answers one of its seven questions
    result = CliRunner().invoke(app, shlex.split(line), input=enough_for_new, prog_name="sagline")
    assert result.exit_code == code, result.output
    if code == 2:
        assert result.stdout == ""
        assert result.stderr.count("\n") == 1
        assert len(result.stderr) <= 300
        assert sorted(folder.rglob("*")) == before
    assert result.stderr.replace(str(folder), "FOLDER") == snapshot
