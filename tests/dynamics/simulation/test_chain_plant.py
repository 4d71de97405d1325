"""A platform with masses at its cable ends compared with sums over the parts."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.dynamics.simulation.chain_plant import _LoadedPlatform
from sagline.kernels.dynamics import rigid_body as body


def parts(seed: int) -> tuple[Array, Array, Array, tuple[Array, Array, Array, Array]]:
    """Inertia of a platform, masses with their places on it, and a motion."""
    rng = np.random.default_rng(seed)
    inertia = np.array([rng.uniform(1, 100), *np.sort(rng.uniform(2, 3, 3))])
    place, velocity, spin = rng.normal(size=(3, 3))
    motion = (place, Rotation.random(random_state=seed).as_matrix(), velocity, spin)
    return inertia, rng.uniform(0, 5, 6), rng.normal(size=(6, 3)), motion


@pytest.mark.parametrize("seed", range(5))
def test_energy_and_momenta_are_sums_over_the_parts(seed: int) -> None:
    inertia, masses, ends, motion = parts(seed)
    place, turning, velocity, spin = motion
    carrier = _LoadedPlatform(inertia, masses, ends)
    state = carrier.state(*motion)
    own = turning @ np.diag(inertia[1:]) @ turning.T
    arms = ends @ turning.T
    speeds = velocity + np.cross(spin, arms)
    momentum = inertia[0] * velocity + masses @ speeds
    whole = inertia[0] + masses.sum()
    assert carrier.inertia[0] == pytest.approx(whole)
    assert whole * state[body.VELOCITY : body.MOMENTUM] == pytest.approx(momentum)
    center = place + (masses @ arms) / whole
    assert state[: body.TURN] == pytest.approx(center)
    moment = inertia[0] * np.cross(place - center, velocity) + own @ spin
    moment += (masses[:, None] * np.cross(place + arms - center, speeds)).sum(axis=0)
    assert state[body.MOMENTUM :] == pytest.approx(moment)
    axes = Rotation.from_quat(state[body.TURN : body.VELOCITY]).as_matrix()
    along = axes.T @ state[body.MOMENTUM :]
    turned = 0.5 * (along**2 / carrier.inertia[1:]).sum()
    energy = 0.5 * inertia[0] * velocity @ velocity + 0.5 * spin @ own @ spin + 0.5 * masses @ (speeds**2).sum(axis=1)
    speed = state[body.VELOCITY : body.MOMENTUM]
    assert 0.5 * whole * speed @ speed + turned == pytest.approx(energy)
    assert carrier.spin(state) == pytest.approx(spin)
    assert center + carrier.levers(ends) @ axes.T == pytest.approx(place + arms)


@pytest.mark.parametrize("seed", range(5))
def test_the_recorded_motion_is_that_of_the_platform(seed: int) -> None:
    inertia, masses, ends, motion = parts(seed)
    carrier = _LoadedPlatform(inertia, masses, ends)
    recorded = np.concatenate((carrier.state(*motion)[: body.MOMENTUM], motion[3]))
    seen = carrier.platform_states(recorded[None])[0]
    assert seen[: body.TURN] == pytest.approx(motion[0])
    assert Rotation.from_quat(seen[body.TURN : body.VELOCITY]).as_matrix() == pytest.approx(motion[1])
    assert seen[body.VELOCITY : body.MOMENTUM] == pytest.approx(motion[2])
    assert seen[body.MOMENTUM :] == pytest.approx(motion[3])


@pytest.mark.parametrize("moments", [[np.inf, np.inf, 2.0], [np.inf] * 3])
def test_a_point_mass_does_not_rotate(moments: list[float]) -> None:
    _, masses, ends, motion = parts(0)
    carrier = _LoadedPlatform(np.array([10.0, *moments]), masses, ends)
    assert np.isinf(carrier.inertia[1:]).tolist() == np.isinf(moments).tolist()
    assert (carrier.axes == np.eye(3)).all()
    if np.isfinite(moments[2]):
        about = masses @ ((ends - carrier.center)[:, :2] ** 2).sum(axis=1) + 10.0 * (carrier.center[:2] ** 2).sum()
        assert carrier.inertia[3] == pytest.approx(2.0 + about)
    assert np.isfinite(carrier.state(*motion)).all()
