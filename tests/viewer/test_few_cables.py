"""The viewer with fewer cables than degrees of freedom: the position is given, the balance determines the rotation."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.viewer.feature import View
from sagline.viewer.features import FEATURES
from sagline.viewer.features.state import code_of
from sagline.viewer.page import Page, Source
from sagline.viewer.snapshot import MissingWrench, Settings, snapshot_at
from sagline.viewer.tension_scale import TensionScale
from sagline.viewer.workspace import WorkspaceQuery
from tests.kinematics.test_underconstrained import suspended
from tests.viewer.client import await_that
from tests.viewer.shown import Shown, shown

FOUR = suspended(4, tension_min=5.0, tension_max=200.0)
HERE = (0.5, 0.3, 1.2)
TURNED = sl.Pose.from_euler(HERE, 1.0, -0.4, 0.3)
SETTINGS = Settings(mass=FOUR.mass)


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, FOUR))


def test_a_state_has_the_rotation_of_the_balance_for_any_rotation_of_the_gizmo() -> None:
    plan = sl.inverse(FOUR, HERE)
    snapshot = snapshot_at(FOUR, TURNED, SETTINGS, None)
    np.testing.assert_array_equal(snapshot.pose.quaternion, plan.state.pose.quaternion)
    np.testing.assert_array_equal(snapshot.tension, plan.chord_tension)
    assert "balance" in snapshot.origin


def test_a_given_yaw_is_that_of_the_gizmo() -> None:
    settings = Settings(mass=FOUR.mass, given=("x", "y", "z", "yaw"))
    snapshot = snapshot_at(FOUR, sl.Pose.from_euler(HERE, -0.01, -0.4, 0.3), settings, None)
    assert snapshot.feasible
    assert snapshot.pose.rotation.as_euler("ZYX")[0] == pytest.approx(-0.01, abs=1e-9)
    view = View(snapshot, settings, TensionScale.of(FOUR), ghost=False)
    names: dict[str, Any] = {"four": FOUR}
    exec(code_of(view, FOUR.replace(name="four"), Source("four"), 0.0), names)
    np.testing.assert_allclose(names["tension"], snapshot.tension, rtol=1e-9)
    yaw = sl.Pose.from_euler(np.zeros(3), -0.01, 0.0, 0.0).quaternion
    query = WorkspaceQuery(FOUR, yaw, sl.Catenary(), sl.Accelerations(), (), settings.given)
    found = query.levels().details(np.array([HERE]))
    assert found.margin[0] == pytest.approx(np.minimum(snapshot.tension - 5.0, 200.0 - snapshot.tension).min())


def test_a_position_without_equilibrium_names_the_cables_and_no_force() -> None:
    snapshot = snapshot_at(FOUR, sl.Pose((1.6, 1.2, 1.2), np.eye(3)), SETTINGS, None)
    assert not snapshot.feasible
    assert snapshot.plan is not None
    assert snapshot.reason.endswith(", ".join(map(str, np.flatnonzero(snapshot.plan.blocking))))
    assert MissingWrench.of(snapshot) is None


def test_copied_code_gives_the_same_tensions() -> None:
    snapshot = snapshot_at(FOUR.replace(name="four"), TURNED, SETTINGS, None)
    view = View(snapshot, SETTINGS, TensionScale.of(FOUR), ghost=False)
    names: dict[str, object] = {"four": FOUR}
    exec(code_of(view, FOUR, Source("four"), 0.0), names)
    np.testing.assert_array_equal(names["tension"], snapshot.tension)


def test_the_region_is_that_of_the_positions() -> None:
    turned = snapshot_at(FOUR, TURNED, SETTINGS, None)
    query = WorkspaceQuery(FOUR, np.array([0.0, 0.0, 0.0, 1.0]), sl.Catenary(), sl.Accelerations())
    found = query.levels().details(np.array([HERE]))
    assert found.margin[0] == pytest.approx(np.minimum(turned.tension - 5.0, 200.0 - turned.tension).min())


def test_the_page_turns_the_platform_and_states_what_is_given(page: Shown) -> None:
    page.viewer.later(lambda: page.viewer.go(TURNED))
    wanted = sl.inverse(FOUR, HERE).state.pose
    gizmo = page.viewer.scene.gizmo
    await_that(lambda: np.allclose(np.roll(gizmo.wxyz, -1), wanted.quaternion, rtol=0.0, atol=1e-12))
    await_that(lambda: np.allclose(page.position, HERE))
    assert "4 cables" in page.text
    assert gizmo.disable_rotations
    assert not page.viewer.panel.method.visible
