import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sagline import Cable, InvalidValueError, PoseBox, Robot
from sagline.core.arrays import Array
from sagline.robot.robot import box_inertia, cylinder_inertia, with_mass
from tests.refusal import refused

CORNERS = np.array([[2.0, 0, 3], [0, 2, 3], [-2, -2, 3]])
FIELDS = {
    "name": "tripod",
    "frame_anchors": CORNERS,
    "platform_anchors": np.zeros((3, 3)),
    "cables": Cable(0.05, 1e5),
    "mass": 4.0,
    "inertia": np.diag([1.0, 2.0, 2.5]),
}


def tripod(**changes: Any) -> Robot:
    return Robot(**{**FIELDS, **changes})


def test_common_values_are_repeated_for_all_cables() -> None:
    robot = tripod(tension_min=5.0, tension_max=[10.0, np.inf, 30.0])
    np.testing.assert_array_equal(robot.cables.linear_density, [0.05, 0.05, 0.05])
    np.testing.assert_array_equal(robot.cables.axial_stiffness, [1e5, 1e5, 1e5])
    np.testing.assert_array_equal(robot.tension_min, [5, 5, 5])
    np.testing.assert_array_equal(robot.tension_max, [10, np.inf, 30])
    np.testing.assert_array_equal(robot.center_of_mass, [0, 0, 0])
    assert (robot.cable_count, robot.gravity, robot.tension_limits_of) == (3, 9.81, "chord")


def test_free_directions_by_hand() -> None:
    np.testing.assert_array_equal(tripod().freedom, np.eye(6))
    np.testing.assert_array_equal(tripod(motion_pattern="3T").freedom, np.eye(6)[:3])
    # the plane of x and z: its normal is -y, because x cross z = -y
    planar = tripod(motion_pattern="1R2T", plane_normal=[0, -3, 0])
    np.testing.assert_array_equal(planar.plane_normal, [0, -1, 0])
    np.testing.assert_array_equal(planar.freedom, [[1, 0, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, 0, 0, -1, 0]])
    level = tripod(motion_pattern="2T", plane_normal=[0, 0, 1])
    np.testing.assert_array_equal(level.freedom, [[1, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0]])
    patterns = {"3R3T": None, "3T": None, "1R2T": [1, 0, 0], "2T": [1, 0, 0]}
    found = [tripod(motion_pattern=p, plane_normal=n).degrees_of_freedom for p, n in patterns.items()]
    assert found == [6, 3, 3, 2]


@given(st.lists(st.floats(-1, 1), min_size=3, max_size=3).filter(lambda v: np.linalg.norm(v) > 1e-3))
@example([0.0, 6e-8, 1.0])  # nearly level, with a unique direction upward
def test_planar_axes_are_right_handed_about_the_normal(normal: list[float]) -> None:
    rows = tripod(motion_pattern="1R2T", plane_normal=normal).freedom
    np.testing.assert_allclose(rows @ rows.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(
        np.cross(rows[0, :3], rows[1, :3]), np.array(normal) / np.linalg.norm(normal), atol=1e-12
    )
    assert rows[1, 2] >= -1e-12 or rows[2, 5] < 0  # upward, except for a level plane seen from below


def test_inertia_of_simple_bodies() -> None:
    # 12 kg: a twelfth of the mass is 1, so that the numbers show the edges
    np.testing.assert_array_equal(box_inertia(12.0, 1.0, 2.0, 3.0), np.diag([13.0, 10.0, 5.0]))
    np.testing.assert_array_equal(cylinder_inertia(12.0, 2.0, 3.0), np.diag([21.0, 21.0, 24.0]))


def test_box_inertia_is_the_integral_over_its_volume() -> None:
    edges, mass, count = np.array([0.3, 0.4, 0.5]), 50.0, 200
    axis = (np.arange(count) + 0.5) / count - 0.5  # midpoint rule, error of order 1/count^2
    second = edges**2 * np.mean(axis**2) * mass
    np.testing.assert_allclose(np.diag(box_inertia(mass, *edges)), second.sum() - second, rtol=1e-4)


def test_inertia_grows_in_proportion_to_the_mass() -> None:
    rope = Cable(0.05, 1e5, diameter=0.004, expansion=1e-5)
    heavier = with_mass(tripod(cables=rope), 6.0)
    assert heavier.mass == 6.0
    assert {name: float(value[0]) for name, value in heavier.cables.known().items()} == {
        "linear_density": 0.05, "axial_stiffness": 1e5, "diameter": 0.004, "expansion": 1e-5
    }  # fmt: skip
    np.testing.assert_allclose(heavier.inertia, 1.5 * tripod().inertia, rtol=1e-15)


def test_a_payload_is_a_point_or_has_the_shape_of_the_platform() -> None:
    own, place = tripod(center_of_mass=(0.1, 0.0, -0.2)), np.array((0.5, -0.3, 1.0))
    loaded = own.with_payload(2.0, at=place)
    assert loaded.mass == 6.0
    np.testing.assert_allclose(loaded.center_of_mass, (4.0 * own.center_of_mass + 2.0 * place) / 6.0, atol=1e-15)

    def about_center(mass: float, center: Array) -> Array:
        x, y, z = center - loaded.center_of_mass  # Steiner's theorem
        return mass * np.array(
            [[y * y + z * z, -x * y, -x * z], [-x * y, x * x + z * z, -y * z], [-x * z, -y * z, x * x + y * y]]
        )

    expected = own.inertia + about_center(4.0, own.center_of_mass) + about_center(2.0, place)
    np.testing.assert_allclose(loaded.inertia, expected, atol=1e-14)
    np.testing.assert_allclose(own.with_payload(2.0).inertia, 1.5 * own.inertia, rtol=1e-15)
    with refused("mass of the payload", "-1 kg"):
        own.with_payload(-1.0)
    with refused("at", "of shape (2,)"):
        own.with_payload(1.0, at=(0, 0))


def test_a_body_that_cannot_turn_needs_no_inertia() -> None:
    np.testing.assert_array_equal(tripod(motion_pattern="3T", inertia=None).inertia, np.zeros((3, 3)))


def test_replace_checks_the_fields_and_keeps_the_original() -> None:
    robot = tripod()
    heavier = robot.replace(mass=9.0)
    assert (heavier.mass, robot.mass) == (9.0, 4.0)
    np.testing.assert_array_equal(heavier.frame_anchors, CORNERS)
    with refused("mass", "-1 kg", "> 0 kg, finite", kind=InvalidValueError):
        robot.replace(mass=-1.0)
    with refused("field", "'weight'", ", ".join(Robot.__slots__), kind=InvalidValueError):
        robot.replace(weight=1.0)


def test_pickling_and_read_only_arrays() -> None:
    robot = tripod(assumed={"mass": "a guess"}, test_box=PoseBox([0, 0, 1], [1, 1, 2], 0.1))
    copy = pickle.loads(pickle.dumps(robot))
    np.testing.assert_array_equal(copy.inertia, robot.inertia)
    np.testing.assert_array_equal(copy.test_box.high, [1, 1, 2])
    assert (dict(copy.assumed), copy.test_box.tilt) == ({"mass": "a guess"}, 0.1)
    with pytest.raises(ValueError, match="read-only"):
        copy.frame_anchors[0, 0] = 1.0
    with pytest.raises(TypeError):
        copy.assumed["mass"] = "certain"


NO_POINTS = np.zeros((0, 3))
SKEW = np.diag([1.0, 2.0, 2.5])
SKEW[0, 1] = 0.1


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        ({"frame_anchors": np.where(CORNERS == -2, np.nan, CORNERS)}, ("frame_anchors[2, 0]", "nan m")),
        ({"frame_anchors": CORNERS[:2]}, ("platform_anchors", "3 points", "as many as frame_anchors, 2")),
        ({"frame_anchors": NO_POINTS, "platform_anchors": NO_POINTS}, ("frame_anchors", "of shape (0, 3)")),
        ({"frame_anchors": np.zeros(3)}, ("frame_anchors", "of shape (3,)")),
        ({"frame_anchors": CORNERS[[0, 1, 0]]}, ("cable 2", "between the same two points as cable 0")),
        ({"mass": 0.0}, ("mass", "0 kg", "> 0 kg, finite")),
        ({"mass": [1.0, 2.0]}, ("mass", "of shape (2,)", "a single number")),
        ({"inertia": None}, ("inertia", "missing")),
        ({"inertia": SKEW}, ("inertia[0, 1]", "0.1 kg m^2", "the same as inertia[1, 0], 0 kg m^2")),
        ({"inertia": np.diag([1.0, -2.0, 1.0])}, ("inertia", "a matrix with the principal moment -2 kg m^2")),
        ({"inertia": np.zeros((3, 3))}, ("inertia", "a matrix with the principal moment 0 kg m^2")),
        ({"gravity": -9.81}, ("gravity", "-9.81 m/s^2", ">= 0 m/s^2, finite")),
        ({"tension_min": [1, 5, 1], "tension_max": [2, 3, 2]}, ("tension_min[1]", "5 N", "<= tension_max[1], 3 N")),
        ({"tension_min": -1.0}, ("tension_min", "-1 N")),
        ({"tension_max": np.nan}, ("tension_max", "nan N")),
        ({"tension_max": [1.0, 2.0]}, ("tension_max", "of shape (2,)")),
        ({"cables": Cable([0.1, 0.0, 0.1], 1e5)}, ("cables: linear_density[1]", "0 kg/m")),
        ({"cables": Cable([0.1, 0.1], 1e5)}, ("cables: linear_density", "of shape (2,)")),
        ({"cables": 0.1}, ("cables", "0.1", "a Cable")),
        ({"motion_pattern": "6D"}, ("motion_pattern", "'6D'", "3R3T, 3T, 1R2T, 2T")),
        ({"tension_limits_of": "winch"}, ("tension_limits_of", "'winch'", "chord, frame_end")),
        ({"motion_pattern": "2T"}, ("plane_normal", "not given for motion_pattern 2T")),
        ({"plane_normal": [0, 0, 1]}, ("plane_normal", "given for motion_pattern 3R3T")),
        ({"motion_pattern": "2T", "plane_normal": [0, 0, 0]}, ("plane_normal", "the zero vector")),
        ({"platform_size": [0.1, 0.0, 0.1]}, ("platform_size[1]", "0 m")),
        ({"assumed": {"weight": "?"}}, ("assumed: field", "'weight'")),
    ],
)
def test_a_wrong_field_is_named(changes: dict[str, Any], parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=InvalidValueError):
        tripod(**changes)


def test_two_cables_may_have_a_common_end() -> None:
    robot = tripod(frame_anchors=CORNERS[[0, 0, 1]], platform_anchors=[[0, 0, 0], [0, 0, 1], [0, 0, 0]])
    assert robot.cable_count == 3


def test_a_flat_box_is_a_box() -> None:
    box = PoseBox([0, 0, 1], [1, 1, 1])
    np.testing.assert_array_equal(box.high, [1, 1, 1])


def test_a_box_with_exchanged_corners_is_refused() -> None:
    with refused("test_box: high[2]", "0 m", ">= low, 1 m", kind=InvalidValueError):
        PoseBox([0, 0, 1], [1, 1, 0])


def test_the_inertia_of_any_body_is_taken() -> None:
    generator = np.random.default_rng(5)
    for flat in (False, True) * 100:  # a few masses with any rotation
        masses, places = generator.uniform(0.1, 2.0, 6), generator.normal(size=(6, 3)) * (1.0, 1.0, float(not flat))
        places = (places - masses @ places / masses.sum()) @ Rotation.random(rng=generator).as_matrix().T
        square = np.einsum("k,ki,kj->ij", masses, places, places)
        tripod(inertia=np.trace(square) * np.eye(3) - square)


@pytest.mark.parametrize("moments", [(1.0, 1.0, 2.03), (0.1, 1.0, 1.2), (5.0, 1.0, 1.0)])
def test_impossible_moments_of_inertia_are_refused_in_any_axes(moments: tuple[float, float, float]) -> None:
    turn = Rotation.from_rotvec([0.3, -1.0, 0.4]).as_matrix()
    small, middle, large = sorted(moments)
    with refused("inertia", allowed="none larger than the sum of the other two", kind=InvalidValueError) as caught:
        tripod(inertia=turn @ np.diag(moments) @ turn.T)
    assert f"{small:g}, {middle:g}, {large:g} kg m^2" in caught.value.value


def test_the_angle_of_a_box_of_poses_is_at_most_half_a_turn() -> None:
    assert PoseBox([0, 0, 0], [1, 1, 1], np.pi).tilt == np.pi
    with refused("test_box: tilt", "6.98132 rad", "0 to pi rad", kind=InvalidValueError):
        PoseBox([0, 0, 0], [1, 1, 1], np.radians(400.0))
