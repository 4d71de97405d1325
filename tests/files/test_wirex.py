from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike
from syrupy.assertion import SnapshotAssertion

from sagline import Cable, FileError, load_wirex
from tests.refusal import refused

TEXT = """<?xml version="1.0" ?>
<models version="0.32">
  <robot name="shelf" motionpattern="3R3T" generator="by hand">
    <geometry>
      <chain id="1" winchtype="small"><base x="-2" y="-1" z="3" a11="1" a22="1" a33="1" radius="0.05" />
        <platform x="-0.1" y="-0.1" z="0.2" /></chain>
      <chain id="2" cable_id="2"><base x="2" y="-1" z="3" radius="0.05" /><platform x="0.1" y="-0.1" z="0.2" /></chain>
      <chain id="3"><base x="0" y="1.5" z="3" radius="0" /><platform x="0" y="0.1" z="0.2" /></chain>
    </geometry>
    <platform name="tray" mass="12.5" swing_angle="40">
      <inertiatensor Ixx="0.5" Ixy="0.01" Ixz="0" Iyy="0.6" Iyz="-0.02" Izz="0.7" />
      <centerofgravity x="0" y="0.01" z="-0.03" />
    </platform>
    <controller ipo_clock="4" />
  </robot>
  <cable id="1" name="thin" elasticity="2.5e10" radius="0.001" weight="0.01" minimum_load="4" breaking_load="900"
    damping="0.1" max_length="30" />
  <cable id="2" name="thick" elasticity="1e10" radius="0.002" weight="0.03" minimum_load="6" breaking_load="2500" />
  <winch id="1" name="small"><cable f_max="800" max_velocity="4" /></winch>
</models>
"""


def load(folder: Path, *changes: tuple[str, str], cables: Cable | None = None):  # type: ignore[no-untyped-def]
    text = TEXT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    file = folder / "shelf.wcrfx"
    file.write_text(text)
    return load_wirex(file, cables)


WINCH = '<winch id="1" name="small"><cable f_max="800" max_velocity="4" /></winch>'


def test_a_robot_in_full(tmp_path: Path) -> None:
    robot = load(tmp_path).robot
    assert (robot.name, robot.mass, robot.motion_pattern, robot.plane_normal) == ("shelf", 12.5, "3R3T", None)
    np.testing.assert_array_equal(robot.frame_anchors, [[-2, -1, 3], [2, -1, 3], [0, 1.5, 3]])
    np.testing.assert_array_equal(robot.platform_anchors, [[-0.1, -0.1, 0.2], [0.1, -0.1, 0.2], [0, 0.1, 0.2]])
    np.testing.assert_array_equal(robot.center_of_mass, [0.0, 0.01, -0.03])
    np.testing.assert_array_equal(robot.inertia, [[0.5, 0.01, 0], [0.01, 0.6, -0.02], [0, -0.02, 0.7]])
    # E pi r^2: 25 GPa at 1 mm, 10 GPa at 2 mm
    np.testing.assert_allclose(robot.cables.axial_stiffness, [78539.816339745, 125663.706143592, 78539.816339745])
    np.testing.assert_array_equal(robot.cables.linear_density, [0.01, 0.03, 0.01])
    np.testing.assert_array_equal(robot.tension_min, [4, 6, 4])
    np.testing.assert_array_equal(robot.tension_max, [800, 800, 800])
    assert list(robot.assumed) == ["inertia"]


def test_lost_data_are_listed(tmp_path: Path) -> None:
    imported = load(tmp_path)
    lost = " ".join(imported.lost)
    assert imported.robot.notes.endswith(lost)
    for what in ("gear", "damping", "controller"):
        assert what in lost
    assert "pulley" not in lost


PULLEYS_GONE = ((' a33="1" radius="0.05"', ' a33="1"'), ('z="3" radius="0.05"', 'z="3"'))


def test_pulleys_and_thick_cables(tmp_path: Path) -> None:
    robot = load(tmp_path).robot
    assert robot.winches is not None
    assert robot.winches.pulley_radius.tolist() == [0.05, 0.05, 0.0]
    assert robot.winches.swivel_axis.tolist() == [[0.0, 0.0, 1.0]] * 3
    assert robot.winches.drum_radius is None
    assert robot.cables.diameter is not None
    assert robot.cables.diameter.tolist() == [0.002, 0.004, 0.002]
    assert "winches" not in robot.assumed
    points = load(tmp_path, *PULLEYS_GONE)
    assert points.robot.winches is None
    assert load(tmp_path, ('radius="0.002"', "")).robot.cables.diameter is None


AXES = 'a11="1" a22="1" a33="1"'
TURNED = 'a11="1.000000" a12="0" a13="0" a21="0" a22="-1.000000" a23="0" a31="0" a32="0" a33="-1.000000"'  # about x
AROUND = 'a11="0" a12="-1" a13="0" a21="1" a22="0" a23="0" a31="0" a32="0" a33="1"'  # about z


@pytest.mark.parametrize(
    ("matrix", "axis"),
    [
        (AXES, 1.0),
        (TURNED, -1.0),
        (AROUND, 1.0),
        ("", 1.0),  # the default values of WireX
        ('a11="0" a13="1" a22="1" a31="-1" a33="0"', None),
        ('a11="1" a22="0.995004" a23="-0.099833" a32="0.099833" a33="0.995004"', None),
        ('a11="0" a22="0" a33="0"', None),
        ('a13="0.001" a33="0.9999995"', None),
    ],
)
def test_only_pulleys_with_a_vertical_axis_are_converted(tmp_path: Path, matrix: str, axis: float | None) -> None:
    imported = load(tmp_path, (AXES, matrix))
    winches = imported.robot.winches
    assert winches is not None
    told = [line for line in imported.lost if "pulley of chain 1 (radius 0.05 m)" in line]
    assert len(told) == (axis is None)
    assert winches.pulley_radius.tolist() == [0.05 if axis else 0.0, 0.05, 0.0]
    assert winches.swivel_axis[0].tolist() == [0.0, 0.0, axis or 1.0]


# a winch of WireX 2: all attributes, with zero for unknown ones
DRIVE = (
    '<winch id="1" name="small" description=""><cable nr_cables="1" f_max="800" l_min="0" max_velocity="4" />'
    '<motor motor_type="servo" inertia="0.002" mass="5" max_power="2000" angular_velocity="300" gear_ratio="0.1" />'
    '<drum r_drum="0.06" l_drum="0.24" nr_groove="40" dfriction="0" sfriction="0" backlash="0" /></winch>'
)


def test_drum_and_motor_of_the_winch(tmp_path: Path) -> None:
    imported = load(tmp_path, (WINCH, DRIVE))
    winches = imported.robot.winches
    assert winches is not None
    for name, value in (("drum_radius", 0.06), ("drum_width", 0.24), ("groove_pitch", 0.006), ("inertia", 0.002)):
        np.testing.assert_allclose(getattr(winches, name), [value] * 3, rtol=1e-15, err_msg=name)
    assert winches.gear.tolist() == [1.0] * 3  # the file does not say which shaft is faster
    assert " gear" in imported.lost[0]


def test_a_drum_without_pulleys(tmp_path: Path) -> None:
    winches = load(tmp_path, (WINCH, DRIVE), *PULLEYS_GONE).robot.winches
    assert winches is not None
    assert winches.pulley_radius.tolist() == [0.0] * 3
    assert winches.drum_radius is not None


def test_a_zero_is_no_drum(tmp_path: Path) -> None:
    zeros = DRIVE.replace("0.06", "0.000000").replace("0.24", "0.000000").replace('"40"', '"0"').replace("0.002", "0")
    winches = load(tmp_path, (WINCH, zeros)).robot.winches
    assert winches is not None
    assert all(getattr(winches, name) is None for name in ("drum_radius", "drum_width", "groove_pitch", "inertia"))
    assert load(tmp_path, (WINCH, zeros), *PULLEYS_GONE).robot.winches is None


def test_the_assignment_of_several_winches_is_unknown(tmp_path: Path, snapshot: SnapshotAssertion) -> None:
    imported = load(tmp_path, (WINCH, DRIVE + DRIVE))
    assert imported.robot.winches is not None
    assert imported.robot.winches.drum_radius is None
    assert imported.lost == snapshot


def test_missing_data_are_assumed_and_listed(tmp_path: Path) -> None:
    robot = load(
        tmp_path,
        (WINCH, ""),
        (' minimum_load="4" breaking_load="900"', ' breaking_load=""'),
        (' weight="0.01"', ' weight="0"'),
        ('elasticity="1e10"', 'elasticity="inf"'),
        ('<centerofgravity x="0" y="0.01" z="-0.03" />', ""),
    ).robot
    np.testing.assert_array_equal(robot.cables.linear_density, [0.065, 0.03, 0.065])
    np.testing.assert_allclose(robot.cables.axial_stiffness, [78539.816339745, 700e3, 78539.816339745])
    np.testing.assert_array_equal(robot.tension_min, [0, 6, 0])
    np.testing.assert_array_equal(robot.tension_max, [np.inf, 2500, np.inf])
    np.testing.assert_array_equal(robot.center_of_mass, [0, 0, 0])
    assert set(robot.assumed) == {"cables", "center_of_mass", "inertia", "tension_min", "tension_max"}
    assert "4 mm" in robot.assumed["cables"]


def test_the_breaking_load_is_the_limit_without_a_winch(tmp_path: Path) -> None:
    robot = load(tmp_path, (WINCH, "")).robot
    np.testing.assert_array_equal(robot.tension_max, [900, 2500, 900])
    assert "breaking load" in robot.assumed["tension_max"]


def test_a_given_material_replaces_that_of_the_file(tmp_path: Path) -> None:
    robot = load(tmp_path, cables=Cable(0.02, 5e4)).robot
    assert robot.cables.linear_density.tolist() == [0.02] * 3


def test_planar_robots_get_a_plane(tmp_path: Path) -> None:
    robot = load(tmp_path, ('motionpattern="3R3T"', 'motionpattern="1R2T"')).robot
    assert robot.plane_normal is not None
    assert robot.plane_normal.tolist() == [0, 0, 1]
    assert "plane_normal" in robot.assumed


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("3R3T", "2R3T", ("motionpattern", "'2R3T'", "3R3T, 3T, 1R2T, 2T")),
        ('mass="12.5" ', "", ("platform: mass", "missing")),
        ('mass="12.5"', 'mass="0"', ("mass", "0 kg")),
        ('base x="2"', 'base x="two"', ("chain 2: base: x", "'two'", "a number in m")),
        ('<platform x="0" y="0.1" z="0.2" />', "", ("chain 3: number of <platform>", "0", "1")),
        ('cable_id="2"', 'cable_id="3"', ("chain 2: cable_id", "'3'", "1 to 2")),
        ('Iyz="-0.02"', "", ("inertiatensor: Iyz", "missing")),
        ('f_max="800"', 'f_max="5"', ("tension_min[1]", "6 N")),
        ('radius="0.001"', 'radius="thin"', ("cable thin: radius", "'thin'")),
        ('a33="1" radius="0.05"', 'a33="1" radius="wide"', ("chain 1: base: radius", "'wide'")),
        ('a33="1" radius="0.05"', 'a33="1" radius="-0.05"', ("winches: pulley_radius[0]", "-0.05 m", ">= 0 m, finite")),
        ('a33="1"', 'a33="up"', ("chain 1: base: a33", "'up'", "a number")),
        (WINCH, DRIVE.replace("0.06", "wide"), ("winch: drum: r_drum", "'wide'")),
        (WINCH, DRIVE.replace("0.06", "-1"), ("winches: drum_radius", "-1 m", "> 0 m, finite")),
        ('radius="0.001"', 'radius="-0.001"', ("cable thin: radius", "-0.001 m")),
        ("<controller", '<platform name="second" /><controller', ("number of <platform>", "2", "1")),
        ('Ixx="0.5"', 'Ixx="5"', ("inertia",)),
        ('Ixx="0.5"', 'Ixx="1_0"', ("inertiatensor: Ixx", "'1_0'", "a number in kg m^2")),
        (' version="0.32"', "", ("version of the format", "missing", "0.31 or 0.32")),
        ('version="0.32"', 'version="9.99"', ("version of the format", "'9.99'", "0.31 or 0.32")),
        ('version="0.32"', 'version="0.3"', ("version of the format", "'0.3'")),
        ("models", "shelves", ("root element", "<shelves>", "<models>")),
        ("robot", "wireRobot", ("robot", "in the old form <wireRobot>")),
        ("chain", "leg", ("number of <chain>", "0")),
        ("</models>", "", ("line 21",)),
    ],
)
def test_invalid_files_are_refused(tmp_path: Path, old: str, new: str, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=FileError):
        load(tmp_path, (old, new))


TENSOR = '<inertiatensor Ixx="0.5" Ixy="0.01" Ixz="0" Iyy="0.6" Iyz="-0.02" Izz="0.7" />'


@pytest.mark.parametrize(
    ("tensor", "inertia", "said"),
    [
        # WireX 0.4 to 1.1, for any platform
        ('<inertiatensor Ixx="14" />', np.diag([14.0, 14.0, 14.0]), "Ixy, Ixz, Iyy, Iyz, Izz"),
        # WireX 2.0: all nine
        (
            '<inertiatensor Ixx="2.000000" Ixy="0.1" Ixz="0.2" Iyx="0.1" Iyy="3" Iyz="0.3" '
            'Izx="0.2" Izy="0.3" Izz="4.000000" />',
            [[2, 0.1, 0.2], [0.1, 3, 0.3], [0.2, 0.3, 4]],
            "center of mass",
        ),
        # the other half, by hand
        ('<inertiatensor Ixx="2" Iyy="3" Izz="4" Iyx="0.1" Izx="0.2" Izy="0.3" />', None, "center of mass"),
        ('<inertiatensor Ixx="2" Iyy="3" Izz="4" />', np.diag([2.0, 3.0, 4.0]), "Ixy, Ixz, Iyz"),
        ('<inertiatensor Iyy="0.2" Ixx="0.5" />', np.diag([0.5, 0.2, 0.5]), "0.5 kg m^2"),
        # a box of 0.2 x 0.2 x 0.02 m and 12.5 kg: the anchors are in a plane
        ("", np.diag([0.0420833333333333, 0.0420833333333333, 0.0833333333333333]), "solid box"),
        ("<inertiatensor />", np.diag([0.0420833333333333, 0.0420833333333333, 0.0833333333333333]), "solid box"),
        (
            '<inertiatensor Ixx="0.000000" Iyy="0.000000" Izz="0.000000" />',
            np.diag([0.0420833333333333, 0.0420833333333333, 0.0833333333333333]),
            "solid box",
        ),
    ],
)
def test_every_writer_s_inertia(tmp_path: Path, tensor: str, inertia: ArrayLike | None, said: str) -> None:
    robot = load(tmp_path, (TENSOR, tensor)).robot
    expected = [[2, 0.1, 0.2], [0.1, 3, 0.3], [0.2, 0.3, 4]] if inertia is None else inertia
    np.testing.assert_allclose(robot.inertia, np.array(expected, dtype=float), rtol=1e-13)
    assert said in robot.assumed["inertia"]


def chain(k: int) -> str:
    """One chain in the output of WireLib: six decimals, the axes of the pulley, a type of winch."""
    turn = " ".join(f'a{j}{i}="{float(i == j):.6f}"' for i in (1, 2, 3) for j in (1, 2, 3))
    x, y, z = (-1) ** k * 2.0, (-1) ** (k // 2) * 1.5, 2.0 * (k < 4)
    return (
        f'<chain id="{k + 1}" winchtype="Old-Winde">'
        f'<base x="{x:.6f}" y="{y:.6f}" z="{z:.6f}" {turn} radius="0.100000" />'
        f'<platform x="{0.05 * x:.6f}" y="{0.1 * y:.6f}" z="{0.1 * z:.6f}" {turn} /></chain>'
    )


GEOMETRY = f"<geometry>{''.join(chain(k) for k in range(8))}</geometry>"
PLATFORM = (
    '<platform name="default_platform" description="default_desc" mass="25.000000" swing_angle="50.000000">'
    '<inertiatensor Ixx="14" /><centerofgravity x="0.000000" y="1.000000" z="0.200000" /></platform>'
)
APPLICATION = '<application name="feeding" id="1" load_mass="25.0" min_cable_load="40.0" max_cable_load="1000.0" />'
CABLE_1_1 = (
    '<cable name="defaultCable" elasticity="110000000000.000000" radius="0.006000" breaking_load="40000.000000" '
    'damping="1.000000" weight="0.023000" minimum_load="0.000000" max_length="0.000000" material="any" />'
)
CABLE_0_4 = '<cable name="c" radius="0.006000" breaking_load="40000.000000" damping="1.000000" weight="0.023000" />'
WINCH_1_1 = '<winch name="Old-Winde"><cable nr_cables="1" f_max="720.000000" f_hold_max="0.000000" /></winch>'
WINCH_0_4 = '<winch name="w"><cable f_max="0.000000" dl_max="0.000000" /><guiding aperture="3.141593" /></winch>'


@pytest.mark.parametrize(
    ("version", "attributes", "inside", "after", "limit", "assumed"),
    [
        # WireLib 0.4 of 2011: no cable, no winch, an application, an attribute with a wrong name
        ("0.31", 'name="A" SEGESTA-Winde=""', APPLICATION, "", np.inf, {"cables", "tension_min", "tension_max"}),
        # the same with a cable without elasticity and a winch without force
        ("0.31", 'name="" id=""', APPLICATION, CABLE_0_4 + WINCH_0_4, 40e3, {"cables", "tension_min", "tension_max"}),
        # WireLib 1.0 and 1.1
        ("0.31", 'name="A" id="1.0"', "", CABLE_1_1 + WINCH_1_1, 720.0, set()),
        ("0.32", 'name="A" id="1.0"', '<controller ipo_clock="4" />', CABLE_1_1 + WINCH_1_1, 720.0, set()),
        # a Windows build writes unknown numbers as 1.#INF00
        (
            "0.32",
            'name="A"',
            "",
            CABLE_1_1.replace("40000.000000", "1.#INF00") + WINCH_0_4,
            np.inf,
            {"tension_max"},
        ),
    ],
)
def test_every_version_s_dialect(
    tmp_path: Path, version: str, attributes: str, inside: str, after: str, limit: float, assumed: set[str]
) -> None:
    file = tmp_path / "stall.wcrfx"
    file.write_text(
        f'<models version="{version}"><robot {attributes} generator="WireLib$Revision: 1024 $" motionpattern="3R3T">'
        f"{GEOMETRY}{PLATFORM}{inside}</robot>{after}</models>"
    )
    imported = load_wirex(file)
    robot = imported.robot
    assert robot.name == ("A" if 'name="A"' in attributes else "stall")
    assert robot.cable_count == 8
    assert robot.tension_max.tolist() == [limit] * 8
    assert set(robot.assumed) == assumed | {"inertia"}
    assert robot.inertia.tolist() == (14.0 * np.eye(3)).tolist()
    assert robot.center_of_mass.tolist() == [0.0, 1.0, 0.2]
    assert ("The application" in " ".join(imported.lost)) == bool(APPLICATION in inside)
