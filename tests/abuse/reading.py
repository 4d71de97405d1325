"""Rule of every reader for every file: read it correctly, or refuse it in one line, in limited time and memory."""

from __future__ import annotations

import resource
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

import sagline as sl
from sagline import SaglineError
from sagline.core.errors import printable
from sagline.files.quantity import pose_of_text
from sagline.files.table import load_readings
from tests.effort import least_seconds

SECONDS: Final = 2.0  # of processor time of an ordinary machine
MEGABYTES: Final = 500.0


@dataclass(frozen=True)
class Reader:
    """A kind of input: a valid sample and its reader."""

    name: str
    sample: str
    read: Callable[[Path], Any]

    def written(self, folder: Path, data: bytes) -> Path:
        """A new file of this kind."""
        file = folder / self.name
        file.write_bytes(data)
        return file


ROBOT = """\
name: shelf
frame_anchors: [[-2, -1, 3], [2, -1, 3 m], [2, 1, 3], [-2000 mm, 1, 3]]
platform_anchors:
  - [-0.1, -0.1, 0.2]
  - [0.1, -0.1, 0.2]
  - [0.1, 0.1, 0.2]
  - [-0.1, 0.1, 0.2]
cables:
  linear_density: 67 g/m
  youngs_modulus: 2 GPa
  section_area: [22 mm^2, 22e-6, 22 mm², 22e-6 m^2]
  diameter: 6.5 mm
  expansion: [-12e-6, 0, 1e-5 1/K, 0]
winches:
  pulley_radius: [40 mm, 0.05, 0, 4 cm]
  swivel_axis: [up, [0, 0, 1], down, [0, 0, -2]]
  dead_cable: [4, 3 m, 2.5, 3]
  dead_rise: -2
  drum_radius: 60 mm
  groove_pitch: 6 mm
  layers: [1, 2, 1, 1]
  gear: [20, -20, 20, 20]
  counts_per_turn: 131072
  inertia: 0.277 kg cm^2
  speed_limit: 3000 rpm
  friction: 15
mass: 12.5
inertia: {Ixx: 0.5, Iyy: 0.6, Izz: 0.7, Ixy: 0.01}
center_of_mass: [0, 0.01, -3 cm]
gravity: 9.81
motion_pattern: 1R2T
plane_normal: [0, 1, 0]
tension_min: 5
tension_max: [300, 300 N, 0.3 kN, .inf]
test_box: {low: [-1, 0, 1], high: [1, 0, 2], tilt: 5 deg}
source: by hand
notes: |
  Two lines
  of notes.
assumed: {tension_min: nobody knows}
"""
WAYPOINTS = """\
rate: 20
profile: septic
durations: [2 s, 500 ms]
waypoints:
  - position: [0, 0, 1.5]
  - {position: [2 m, 1500 mm, 1.5], euler: {alpha: 20 deg, gamma: 0.1}}
  - position: [2, 1, 1.5]
    quaternion: [0, 0, 0.6, 0.8]
"""
PATH = "time [s],x [mm],y,z,alpha [deg],beta,gamma\n0,0,0.5,1,0,0,0\n0.5,10,0.5,1,1,0,0\n1,20,0.5,1.5,2,0.1,-0.25\n"
LENGTHS = "time,L0,L1 [mm],L2,L3\n0,2.5,2500,2.75,3\n0.1,2.5,2510.5,2.75,3e0\n"
COUNTS = "time,C0,C1,C2,C3\n0,-250,2500,2750.5,3e3\n0.1,2500,-2510,2750,3\n"
MEASURED = "span [m],rise,length [m],tension [kN]\n10,-2.5,10.4,0.1\n12,3.25,12.6,0.2\n"
LOG = """\
# length_deviation: 0.5 mm
# tension_deviation: [5, 5, 0.005 kN]
# position_deviation: 1 mm
# frame: {position: [1, 0, 500 mm], euler: {alpha: 90 deg}}
time [s],count_0,count_1,count_2,load_cell_0 [kN],load_cell_1,load_cell_2,x [mm],y,z,x_commanded,y_commanded,z_commanded
0,320530,312004.5,-299911,0.41,520,390,1012.5,1,2,1,1.5,2
30,318112,311870,301442,0.44,,410,,,,1,1.5,2.5
"""
WIREX = """<?xml version="1.0" ?>
<models version="0.32">
  <robot name="shelf" motionpattern="3R3T" generator="by hand">
    <geometry>
      <chain id="1"><base x="-2" y="-1" z="3" a33="1" radius="0.05" />
        <platform x="-0.1" y="-0.1" z="0.2" /></chain>
      <chain id="2" cable_id="2"><base x="2" y="-1" z="3" /><platform x="0.1" y="-0.1" z="0.2" /></chain>
      <chain id="3"><base x="0" y="1.5" z="3" radius="0" /><platform x="0" y="0.1" z="0.2" /></chain>
    </geometry>
    <platform name="tray" mass="12.5">
      <inertiatensor Ixx="0.5" Ixy="0.01" Ixz="0" Iyy="0.6" Iyz="-0.02" Izz="0.7" />
      <centerofgravity x="0" y="0.01" z="-0.03" />
    </platform>
  </robot>
  <cable name="thin" elasticity="2.5e10" radius="0.001" weight="0.01" minimum_load="4" breaking_load="900" />
  <cable name="thick" elasticity="1e10" radius="0.002" weight="0.03" minimum_load="6" breaking_load="2500" />
  <winch name="small"><cable f_max="800" /><motor inertia="0.002" gear_ratio="0.1" />
    <drum r_drum="0.06" l_drum="0.24" nr_groove="40" /></winch>
</models>
"""


def _caspr_cable(name: str, frame: str, platform: str) -> str:
    ends = "".join(
        f"<attachment><link>{k}</link><location>{place}</location></attachment>"
        for k, place in enumerate((frame, platform))
    )
    if name == "a":
        entry = "<cable_entry_vector>0 0 -1</cable_entry_vector><pulley_radius>0.04</pulley_radius></attachment>"
        ends = ends.replace("</attachment>", entry, 1).replace("attachment>", "attachment_base_pulley>", 2)
    limits = "<force_min>5</force_min><force_max>300</force_max><K>9e4</K>"
    return (
        f'<cable_linear_spring name="{name}" attachment_reference="com"><properties>{limits}</properties>'
        f"<attachments>{ends}</attachments></cable_linear_spring>"
    )


CASPR_BODIES = """<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE bodies_system SYSTEM "bodies.dtd">
<bodies_system><links><link_rigid num="1" name="gondola">
  <joint type="PLANAR_XZ" q_initial="0 0 1"/>
  <physical><mass>8</mass><com_location>0.1 0.0 -0.2</com_location>
    <inertia ref="com"><Ixx>0</Ixx><Iyy>0.5</Iyy><Izz>0</Izz><Ixy>0</Ixy><Ixz>0</Ixz><Iyz>0</Iyz></inertia></physical>
  <parent><num>0</num><location>0 0 0.5</location></parent>
</link_rigid></links></bodies_system>
"""
CASPR_CABLES = (
    '<cables default_cable_set="all"><cable_set id="all">'
    + _caspr_cable("a", "-3 0 4", "-0.2 0 0.1")
    + _caspr_cable("b", "3 0 4", "0.2 0 0.1")
    + _caspr_cable("c", "0 0 -4", "0 0 -0.1")
    + "</cable_set></cables>"
)


def _caspr_beside(other: str, text: str) -> Callable[[Path], Any]:
    def read(file: Path) -> Any:
        (file.parent / other).write_text(text)
        return sl.load_caspr(file)

    return read


PROGRAM = """\
%
N10 G21 G90 G17 (a part) ; metric
G0 X0 Y0 Z1500
G64 P1 F6000
G1 X500 Y-250.5
G2 X700 Y-50.5 I200 J0
G20 G91
G3 X2 Z.5 R4 F300
G4 P0.25
G92 X0 Y0
G18 G90 G1 X10 Z60
M30
"""
COLUMNS = """\
columns:
  time: {name: t, unit: ms}
  length: {name: "l{}", unit: mm, scale: -1, cables: [2, 1]}
  load_cell_1: force
length_deviation: 0.5 mm
tension_deviation: 5 N
frame: {position: [1, 0, 0.5], euler: {alpha: 90 deg}}
"""


def _log_with_columns(file: Path) -> Any:
    other = file.parent / "other.csv"
    other.write_text("t,l1,l2,force,note\n0,-2500,-2600,40,a\n1,-2400,-2700,,b\n")
    return sl.load_log(other, columns=file)


READERS: Final = (
    Reader("robot.yaml", ROBOT, sl.load_robot),
    Reader("tour.yaml", WAYPOINTS, sl.load_path),
    Reader("tour.csv", PATH, sl.load_path),
    Reader("part.ngc", PROGRAM, sl.load_path),
    Reader("lengths.csv", LENGTHS, lambda file: load_readings(file, "length", 4, 5.0)),
    Reader("counts.csv", COUNTS, lambda file: load_readings(file, "count", 4)),
    Reader("cable.csv", MEASURED, sl.load_measurements),
    Reader("winches.csv", LOG, sl.load_log),
    Reader("columns.yaml", COLUMNS, _log_with_columns),
    Reader("shelf.wcrfx", WIREX, sl.load_wirex),
    Reader("gondola_bodies.xml", CASPR_BODIES, _caspr_beside("gondola_cables.xml", CASPR_CABLES)),
    Reader("gondola_cables.xml", CASPR_CABLES, _caspr_beside("gondola_bodies.xml", CASPR_BODIES)),
    Reader(
        "pose.txt",
        "1.5,-0.25,2,10,20,30",
        lambda file: pose_of_text(file.read_bytes().decode("utf-8", "surrogateescape")),
    ),
)


def judged(call: Callable[[], Any], what: str) -> Any:
    """Result of a call, or its error, after a check of the limits on time, memory and message.

    Args:
        call: The call.
        what: Name of the case for the message of a failure.

    Returns:
        The result, or the SaglineError.
    """
    before, start = _peak(), time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            found = call()
        except SaglineError as error:
            found = error
            text = str(error)
            assert len(text) < 300, f"{what}: {len(text)} letters"
            assert text == printable(text), f"{what}: {text!r}"
            text.encode("utf-8")
        except BaseException as error:
            raise AssertionError(f"{what}: {type(error).__name__}: {error}"[:2000]) from error
    seconds = time.process_time() - start
    seconds = seconds if seconds < SECONDS else least_seconds(call, SECONDS, seconds)
    assert seconds < SECONDS, f"{what}: {seconds:.1f} s"
    assert _peak() - before < MEGABYTES, f"{what}: {_peak() - before:.0f} MB more than before"
    return found


def sound(found: Any, what: str) -> None:
    """The result can be used: its numbers are finite, and the solver returns a solution or an error."""
    robot = getattr(found, "robot", found)
    if isinstance(robot, sl.Robot):
        lines = "\n".join((robot.name, robot.source, robot.notes, *robot.assumed.values())).split("\n")
        assert robot.name in lines, what
        for line in lines:
            assert line.replace("\t", " ") == printable(line.replace("\t", " ")), what
        for array in (robot.frame_anchors, robot.platform_anchors, robot.inertia, robot.center_of_mass):
            assert np.isfinite(array).all(), what
        place = sl.Pose(robot.frame_anchors.mean(axis=0) - [0.0, 0.0, 0.5], np.eye(3))
        plan = judged(lambda: sl.inverse(robot, place), what)
        if isinstance(plan, sl.Plan) and plan.feasible:
            assert np.isfinite(plan.unstrained_length).all(), what
    elif isinstance(found, sl.Path):
        for array in (found.time, found.pose.position, found.pose.quaternion, found.twist, found.twist_rate):
            assert np.isfinite(array).all(), what
    elif isinstance(found, tuple):
        for array in found:
            assert array is None or np.isfinite(array).all(), what


def _peak() -> float:
    """Largest memory of this process so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
