import pickle
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline import Mesh, dump_robot
from sagline.files.workspace_file import QUANTITIES
from tests.files.wording import wording
from tests.refusal import refused
from tests.tiers import extended, wide

ROBOT = sl.load_robot("article-suspended")
WALL = (
    sl.Box([0.2, 12.0, 1.0], [1.0, 0.0, 0.5], name="wall"),
    sl.Sphere([0.0, 0.0, 9.0], 0.25, name="lamp"),
    sl.Capsule([0.0, 0.0, 8.0], [1.0, 0.0, 8.0], 0.1, name="rod"),
)
SPACES: dict[str, dict[str, Any]] = {
    "all that there can be": {
        "wrenches": sl.WrenchBox(20.0, 2.0, [0, 0, 5, 0, 0, 0])
        + sl.WrenchEllipsoid(3.0, 0.1)
        + sl.WrenchPolytope([[0, 0, 1, 0, 0, 0], [0, 0, 0, 0, 0, 1]])
        + sl.Accelerations(0.1, 0.2),
        "orientations": sl.Orientations(sl.Pose.from_euler(np.zeros(3), [0.0, 0.3], 0.0, 0.1).matrix, "any"),
        "criteria": [
            sl.MaximumSag(0.3),
            sl.PositionError(sl.Empirical(), 0.4),
            sl.LeastStiffness(1.0 / 3.0),
            sl.LeastFrequency(0.1),
            sl.Clearance(0.01, WALL),
            sl.InFrame(0.05),
            sl.LeastMargin(1.0 / 7.0),
        ],
        "model": sl.Elastic(),
        "tension": sl.QuadraticProgram(target=100.0),
        "moment_arm": 0.123,
    },
    "empty": {"wrenches": sl.WrenchBox(5000.0)},
    "in a plane": {"box": sl.PoseBox([-6, -4, 2], [6, 4, 2], 0.01)},
}


def space_of(name: str) -> sl.Workspace:
    return sl.workspace(ROBOT, **SPACES[name], cells=4, refine=False)


def assert_same(space: sl.Workspace, other: sl.Workspace) -> None:
    for quantity in QUANTITIES:
        mine, theirs = (np.asarray(quantity.of(each)) for each in (space, other))
        assert (mine.dtype, mine.shape) == (theirs.dtype, theirs.shape), quantity.place
        assert mine.tobytes() == theirs.tobytes(), quantity.place
        assert not theirs.flags.writeable, quantity.place
    for field in ("volume", "volume_error", "unit", "open_faces", "moment_arm", "model", "limits"):
        assert getattr(space, field) == getattr(other, field), field
    assert [str(one) for one in space.criteria] == [str(one) for one in other.criteria]
    assert repr(space.tension) == repr(other.tension)
    assert space.orientations.need == other.orientations.need
    assert np.array_equal([space.box.low, space.box.high], [other.box.low, other.box.high])
    assert space.box.tilt == other.box.tilt
    assert repr(space.nearest) == repr(other.nearest)
    assert dump_robot(space.robot) == dump_robot(other.robot)


@pytest.mark.parametrize("name", wide(SPACES))
def test_a_loaded_workspace_is_equal(name: str, tmp_path: FilePath) -> None:
    space = space_of(name)
    space.save(tmp_path / "space.nc")
    found = sl.load_workspace(tmp_path / "space.nc")
    assert_same(space, found)
    places = np.random.default_rng(4).uniform(space.box.low, space.box.high, (50, 3))
    assert found.levels()(places).tobytes() == space.levels()(places).tobytes()
    assert_same(space, pickle.loads(pickle.dumps(space)))


@extended
def test_obstacles_are_saved(tmp_path: FilePath) -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    mesh = Mesh(corners + 9.0, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], "corner")
    space = sl.workspace(ROBOT, criteria=[sl.Clearance(0.01, (*WALL, mesh))], cells=4)
    space.save(tmp_path / "space.nc")
    criterion = sl.load_workspace(tmp_path / "space.nc").criteria[1]
    assert isinstance(criterion, sl.Clearance)
    assert repr(criterion.obstacles) == repr((*WALL, mesh))


@extended
def test_other_files_are_refused(tmp_path: FilePath, snapshot: SnapshotAssertion) -> None:
    space_of("in a plane").save(tmp_path / "space.nc")
    whole = (tmp_path / "space.nc").read_bytes()
    with refused(kind=sl.FileError, file=tmp_path / "space.nc") as caught:
        sl.load_plan(tmp_path / "space.nc")
    assert wording(caught.value, tmp_path) == snapshot
    (tmp_path / "cut.nc").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "changed.nc").write_bytes(whole.replace(b"limiting", b"LIMITING"))
    (tmp_path / "text.nc").write_text("x")
    for name in ("cut.nc", "changed.nc", "text.nc", "missing.nc"):
        with refused(kind=sl.FileError, file=tmp_path / name):
            sl.load_workspace(tmp_path / name)


def test_custom_criteria_cannot_be_loaded(tmp_path: FilePath) -> None:
    class Own(sl.MaximumSag):
        pass

    space = sl.workspace(ROBOT, criteria=[Own(0.1)], cells=4)
    with refused("criterion_1", "Own", kind=sl.InvalidValueError):
        space.save(tmp_path / "space.nc")
    assert not list(tmp_path.iterdir())
