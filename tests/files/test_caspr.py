from pathlib import Path

import numpy as np
import pytest
from syrupy.assertion import SnapshotAssertion

from sagline import Cable, FileError, load_caspr
from tests.files.wording import wording
from tests.refusal import refused

BODIES = """<?xml version="1.0" encoding="utf-8"?>
<links display_range="-3 3 -2 2 0 4">
  <link_rigid num="1" name="gondola">
    <joint type="SPATIAL_EULER_XYZ" q_initial="0 0 1 0 0 0"/>
    <physical>
      <mass>8</mass>
      <com_location>0.1 0.0 -0.2</com_location>
      <end_location>0 0 0.3</end_location>
      <inertia ref="joint">
        <Ixx>0.82</Ixx><Iyy>1.00</Iyy><Izz>0.48</Izz><Ixy>0</Ixy><Ixz>0.16</Ixz><Iyz>0</Iyz>
      </inertia>
    </physical>
    <parent><num>0</num><location>0 0 0.5</location></parent>
  </link_rigid>
</links>
"""


def cable(kind: str, name: str, reference: str, properties: str, attachments: str) -> str:
    return (
        f'<{kind} name="{name}" attachment_reference="{reference}">'
        f"<properties>{properties}</properties><attachments>{attachments}</attachments></{kind}>"
    )


def point(link: int, place: str) -> str:
    return f"<attachment><link>{link}</link><location>{place}</location></attachment>"


LIMITS = "<force_min>5</force_min><force_max>300</force_max>"
IDEAL = cable("cable_ideal", "left", "joint", LIMITS, point(0, "-3 0 4") + point(1, "-0.2 0 0.1"))
SPRING = cable("cable_linear_spring", "right", "com", LIMITS + "<K>9e4</K>", point(1, "0.2 0 0.1") + point(0, "3 0 4"))
PULLEY = cable(
    "cable_ideal",
    "rear",
    "joint",
    LIMITS,
    "<attachment_base_pulley><link>0</link><fixed_location>0 2 4</fixed_location><pulley_radius>0.04</pulley_radius>"
    "</attachment_base_pulley>" + point(1, "0 0.2 0"),
)
PASSIVE = cable(
    "cable_passive_linear_spring", "spring 1", "com", "<K>5</K><l0>1</l0>", point(0, "0 0 5") + point(1, "0 0 0")
)


def cables_file(*cables: str, default: str = "all") -> str:
    return (
        '<!DOCTYPE cables [<!ATTLIST cable_set id ID #REQUIRED>]><cables default_cable_set="' + default + '">'
        f'<cable_set id="all">{"".join(cables)}</cable_set><cable_set id="one">{IDEAL}</cable_set></cables>'
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "gondola_bodies.xml").write_text(BODIES)
    (tmp_path / "cables").mkdir()
    (tmp_path / "cables" / "gondola_cables.xml").write_text(cables_file(IDEAL, SPRING, PULLEY, PASSIVE))
    (tmp_path / "gondola_trajectories.xml").write_text("<trajectories/>")
    return tmp_path


def test_a_robot_in_full(folder: Path) -> None:
    imported = load_caspr(folder)
    robot = imported.robot
    assert (robot.name, robot.mass, robot.motion_pattern) == ("gondola", 8.0, "3R3T")
    np.testing.assert_array_equal(robot.frame_anchors, [[-3, 0, 4], [3, 0, 4], [0, 2, 4]])
    # the end of the second cable is given from the center of mass, (0.1, 0, -0.2)
    np.testing.assert_allclose(robot.platform_anchors, [[-0.2, 0, 0.1], [0.3, 0, -0.1], [0, 0.2, 0]], atol=1e-15)
    np.testing.assert_array_equal(robot.center_of_mass, [0.1, 0.0, -0.2])
    # Steiner's theorem by hand: 8 kg at (0.1, 0, -0.2) takes 0.32, 0.40, 0.08 and adds 8 * 0.1 * -0.2 to Ixz
    np.testing.assert_allclose(robot.inertia, [[0.5, 0, 0], [0, 0.6, 0], [0, 0, 0.4]], atol=1e-15)
    np.testing.assert_array_equal(robot.tension_min, [5, 5, 5])
    np.testing.assert_array_equal(robot.tension_max, [300, 300, 300])
    np.testing.assert_array_equal(robot.cables.axial_stiffness, [700e3, 90e3, 700e3])
    np.testing.assert_array_equal(robot.cables.linear_density, [0.065] * 3)
    assert "4 mm" in robot.assumed["cables"]


def test_lost_data_are_listed(folder: Path, snapshot: SnapshotAssertion) -> None:
    imported = load_caspr(folder)
    assert imported.robot.notes.endswith(" ".join(imported.lost))
    assert imported.lost == snapshot


def entered(vector: str, radius: str = "0.04", tag: str = "attachment_base_pulley") -> str:
    entry = f"<cable_entry_vector>{vector}</cable_entry_vector>"
    fixed = f"<fixed_location>0 2 4</fixed_location><pulley_radius>{radius}</pulley_radius>"
    attachments = f"<{tag}><link>0</link>{fixed}{entry}</{tag}>" + point(1, "0 0.2 0")
    return cable("cable_ideal", "rear", "joint", LIMITS, attachments)


@pytest.mark.parametrize(("vector", "axis"), [("0 0 1", 1.0), ("0.0 0 -2", -1.0), ("0 -0 0.5", 1.0)])
def test_a_pulley_with_a_vertical_cable_is_converted(folder: Path, vector: str, axis: float) -> None:
    (folder / "cables" / "gondola_cables.xml").write_text(cables_file(IDEAL, SPRING, entered(vector)))
    imported = load_caspr(folder)
    winches = imported.robot.winches
    assert winches is not None
    assert winches.pulley_radius.tolist() == [0.0, 0.0, 0.04]
    assert winches.swivel_axis.tolist() == [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, axis]]
    assert imported.robot.frame_anchors[2].tolist() == [0.0, 2.0, 4.0]
    assert "pulley" not in " ".join(imported.lost)


@pytest.mark.parametrize(
    "pulley",
    [
        entered("1 0 0"),
        entered("0 0.01 1"),
        entered("0 0 0"),
        entered("0 0 1", tag="attachment_roller"),
        PULLEY,
    ],
    ids=["level", "tilted", "no direction", "roller", "no direction given"],
)
def test_an_unsupported_pulley_is_listed_as_lost(folder: Path, pulley: str, snapshot: SnapshotAssertion) -> None:
    (folder / "cables" / "gondola_cables.xml").write_text(cables_file(IDEAL, SPRING, pulley))
    imported = load_caspr(folder)
    assert imported.robot.winches is None
    assert [line for line in imported.lost if "rear" in line] == snapshot


@pytest.mark.parametrize(
    ("pulley", "parts"),
    [
        (entered("0 0"), ("cable_ideal rear: cable_entry_vector", "'0 0'", "3 numbers between blanks")),
        (entered("0 0 1", "wide"), ("cable_ideal rear: pulley_radius", "'wide'", "a number in m")),
        (entered("0 0 1", "-0.1"), ("winches: pulley_radius[2]", "-0.1 m", ">= 0 m, finite")),
    ],
)
def test_an_invalid_pulley_is_refused(folder: Path, pulley: str, parts: tuple[str, ...]) -> None:
    (folder / "cables" / "gondola_cables.xml").write_text(cables_file(IDEAL, SPRING, pulley))
    with refused(*parts, kind=FileError):
        load_caspr(folder)


@pytest.mark.parametrize("file", ["gondola_bodies.xml", "cables/gondola_cables.xml"])
def test_each_file_finds_the_other(folder: Path, file: str) -> None:
    assert load_caspr(folder / file).robot.cable_count == 3


def test_the_named_file_has_priority(folder: Path) -> None:
    (folder / "other_cables.xml").write_text(cables_file(IDEAL))
    assert load_caspr(folder / "other_cables.xml").robot.cable_count == 1
    with refused("CASPR files of cables", kind=FileError, file=folder) as caught:
        load_caspr(folder)
    assert "(gondola_cables.xml, other_cables.xml)" in caught.value.reason


def test_choice_of_cable_set_and_material(folder: Path) -> None:
    imported = load_caspr(folder, Cable(0.02, 5e4), "one")
    assert imported.robot.cable_count == 1
    assert imported.robot.cables.linear_density.tolist() == [0.02]
    assert not imported.robot.assumed
    with refused("cable set", "'two'", "'all', 'one'", kind=FileError):
        load_caspr(folder, cable_set="two")


@pytest.mark.parametrize(
    ("joint", "pattern", "normal"),
    [
        ("T_XYZ", "3T", None),
        ("PLANAR_XY", "1R2T", [0, 0, 1]),
        ("PLANAR_XZ", "1R2T", [0, 1, 0]),
        ("PLANAR_YZ", "1R2T", [1, 0, 0]),
        ("P_XY", "2T", [0, 0, 1]),
    ],
)
def test_joints_become_patterns(folder: Path, joint: str, pattern: str, normal: list[float] | None) -> None:
    (folder / "gondola_bodies.xml").write_text(BODIES.replace("SPATIAL_EULER_XYZ", joint))
    robot = load_caspr(folder).robot
    assert robot.motion_pattern == pattern
    assert (None if robot.plane_normal is None else robot.plane_normal.tolist()) == normal


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        (
            "SPATIAL_EULER_XYZ",
            "R_Z",
            (
                "joint type",
                "'R_Z'",
                ("SPATIAL, SPATIAL_EULER_XYZ, SPATIAL_QUATERNION, T_XYZ, PLANAR_XY, PLANAR_XZ, PLANAR_YZ, P_XY, P_XZ"),
            ),
        ),
        ("<mass>8</mass>", "", ("mass", "missing")),
        ("<mass>8</mass>", "<mass>eight</mass>", ("mass", "'eight'", "a number in kg")),
        ("<mass>8</mass>", "<mass>-8</mass>", ("mass", "-8 kg")),
        ('ref="joint"', "", ("inertia: ref", "''")),
        ("</links>", BODIES[BODIES.index("<link_rigid") :], ("number of <link_rigid>", "2", "1")),
        ("<Ixx>0.82</Ixx>", "<Ixx>0.1</Ixx>", ("inertia", "a matrix with the principal moment -0.22 kg m^2")),
    ],
)
def test_invalid_bodies_are_refused(folder: Path, old: str, new: str, parts: tuple[str, ...]) -> None:
    (folder / "gondola_bodies.xml").write_text(BODIES.replace(old, new))
    with refused(*parts, kind=FileError):
        load_caspr(folder)


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        (point(0, "-3 0 4"), "", ("cable_ideal left: number of attachments", "1", "2")),
        (point(0, "-3 0 4"), point(0, "-3 0 4") + point(0, "0 0 4"), ("cable_ideal left: number of attachments", "3")),
        (point(0, "-3 0 4"), point(2, "-3 0 4"), ("cable_ideal left: links", "2, 1", "0, 1")),
        (
            point(0, "-3 0 4"),
            point(0, "-3 0"),
            ("cable_ideal left: location on link 0", "'-3 0'", "3 numbers between blanks in m"),
        ),
        ("<force_max>300</force_max>", "", ("cable_ideal left: force_max", "missing")),
        ("<force_max>300</force_max>", "<force_max>3</force_max>", ("tension_min[0]", "5 N")),
        ("cable_set id", "set id", ("line 1",)),
        ("cable_set", "group", ("cable set", "''", "none")),
    ],
)
def test_invalid_cables_are_refused(folder: Path, old: str, new: str, parts: tuple[str, ...]) -> None:
    (folder / "cables" / "gondola_cables.xml").write_text(cables_file(IDEAL, SPRING).replace(old, new))
    with refused(*parts, kind=FileError):
        load_caspr(folder)


def test_missing_files_are_refused(folder: Path, snapshot: SnapshotAssertion) -> None:
    for name in ("none", "gondola_trajectories.xml"):
        with refused(kind=FileError, file=folder / name) as caught:
            load_caspr(folder / name)
        assert wording(caught.value, folder) == snapshot
    (folder / "gondola_bodies.xml").unlink()
    with refused("CASPR files of bodies", kind=FileError, file=folder) as caught:
        load_caspr(folder)
    assert "(none)" in caught.value.reason


# the four inertias of CASPR's own planar models: zero about axes without rotation
@pytest.mark.parametrize(
    ("joint", "moments", "turns"),
    [
        ("PLANAR_XY", (0.0, 0.0, 0.1), True),
        ("PLANAR_XZ", (0.0, 0.2, 0.0), True),
        ("PLANAR_YZ", (0.0925, 0.0, 0.0), True),
        ("PLANAR_XZ", (1.0, 1.0, 1.0), True),
        ("P_XY", (0.0, 0.0, 0.0), False),
        ("P_XZ", (0.0, 0.0, 0.3), False),
        ("T_XYZ", (0.0, 0.0, 0.0), False),
    ],
)
def test_only_the_used_moment_of_inertia_must_be_positive(
    folder: Path, joint: str, moments: tuple[float, float, float], turns: bool
) -> None:
    given = "".join(f"<I{a}{a}>{moment}</I{a}{a}>" for a, moment in zip("xyz", moments, strict=True))
    start, end = BODIES.index("<inertia"), BODIES.index("</inertia>")
    text = BODIES[:start] + f'<inertia ref="com">{given}<Ixy>0</Ixy><Ixz>0</Ixz><Iyz>0</Iyz>' + BODIES[end:]
    (folder / "gondola_bodies.xml").write_text(text.replace("SPATIAL_EULER_XYZ", joint))
    robot = load_caspr(folder).robot
    assert np.diag(robot.inertia).tolist() == list(moments)
    if turns:
        assert robot.plane_normal is not None
        about = float(robot.plane_normal @ robot.inertia @ robot.plane_normal)
        nothing = text.replace("SPATIAL_EULER_XYZ", joint).replace(f">{about}<", ">0.0<")
        (folder / "gondola_bodies.xml").write_text(nothing)
        with refused("inertia", "a matrix with 0 kg m^2 about plane_normal", "> 0 kg m^2", kind=FileError):
            load_caspr(folder)


def test_a_solid_turning_about_every_axis_has_all_moments(folder: Path) -> None:
    for given, value in (
        ("0.0", "a matrix with the principal moment 0 kg m^2"),
        ("9.9", "a matrix with the principal moments 0.82, 1, 9.9 kg m^2"),
    ):
        text = BODIES.replace('ref="joint"', 'ref="com"').replace("<Ixz>0.16</Ixz>", "<Ixz>0</Ixz>")
        (folder / "gondola_bodies.xml").write_text(text.replace("<Izz>0.48</Izz>", f"<Izz>{given}</Izz>"))
        with refused("inertia", value, kind=FileError):
            load_caspr(folder)


def test_other_headers_comments_and_cable_laws(folder: Path) -> None:
    body = BODIES[BODIES.index("<links") :]
    for head, tail in (
        ('<?xml version="1.0" encoding="utf-8"?>\n<!DOCTYPE bodies_system SYSTEM "../../t/bodies.dtd">\n<bodies_system>'
         '<!-- <link_rigid num="1"><joint type="R_Z"/></link_rigid> -->', "</bodies_system>"),
        ('<?xml version="1.0" encoding="ISO-8859-1"?><bodies_system>', "</bodies_system>"),
        ("", ""),
    ):  # fmt: skip
        (folder / "gondola_bodies.xml").write_text(head + body + tail)
        assert load_caspr(folder).robot.mass == 8.0
    law = cable(
        "cable_vsd_torsion_spring",
        "torsion",
        "com",
        "<K_cable>13000</K_cable><num_torsion_springs>4</num_torsion_springs>" + LIMITS + "<diameter>0.4</diameter>",
        point(0, "-3 0 4") + point(1, "-0.2 0 0.1"),
    )
    (folder / "cables" / "gondola_cables.xml").write_text(cables_file(law, SPRING))
    imported = load_caspr(folder)
    assert imported.robot.cables.axial_stiffness.tolist() == [700e3, 90e3]
    assert [line for line in imported.lost if "torsion: " in line and "stiffness" in line]
