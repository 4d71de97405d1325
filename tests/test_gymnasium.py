"""The environment agrees with `simulate`, with its vectorized form and with the rules of Gymnasium."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import sagline as sl
import sagline.gymnasium as environment
from tests.refusal import refused

ID = "sagline/CableRobot-v0"


def robots(count: int, **settings: Any) -> Any:
    return gymnasium.make_vec(ID, num_envs=count, vectorization_mode="vector_entry_point", **settings)


def test_importing_sagline_does_not_import_gymnasium() -> None:
    code = "import sys, sagline as sl; sl.load_robot('cogiro'); sys.exit('gymnasium' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.filterwarnings("ignore:.*A Box observation space (min|max)imum value is")
@pytest.mark.filterwarnings("ignore:.*Not able to test alternative render modes")
@pytest.mark.parametrize("action", ["speed", "length"])
def test_the_rules_of_gymnasium_are_kept(action: str) -> None:
    check_env(gymnasium.make(ID, action=action, episode_steps=5).unwrapped)


@pytest.mark.parametrize("action", ["speed", "length"])
def test_an_episode_is_the_motion_of_simulate(action: str) -> None:
    """Position, tensions and reward of an episode with a break, a drop and a pick-up."""
    robot, seed = sl.load_robot("cogiro"), np.random.default_rng(4)
    start, target = sl.Pose([0.5, -1.0, 2.0]), sl.Pose.from_euler([1.0, 0.5, 2.5], 0.1, 0.05, -0.1)
    events: list[Any] = [sl.Break(2, 0.1), sl.Drop(20.0, 0.2), sl.PickUp(30.0, 0.3)]
    env: Any = gymnasium.make(ID, robot=robot, action=action, speed=0.2, step=1e-3)
    env.reset(options={"start": start, "target": target, "events": events})
    state = sl.inverse(robot, start).state
    lengths, seen, rewards = [np.array(state.unstrained_length)], [], []
    for _ in range(40):
        observation, reward, terminated, _, _ = env.step(seed.uniform(-1.0, 1.0, 8))
        assert not terminated
        lengths.append(env.unwrapped._episodes._length[0].copy())
        seen.append(observation)
        rewards.append(reward)
    assert np.abs(np.diff(lengths, axis=0)).max() <= 0.2 * 0.01 * (1.0 + 1e-12)
    table = (0.01 * np.arange(41), np.array(lengths))
    run = sl.simulate(state, unstrained_length=table, step=1e-3, record=0.01, integrator="splitting", events=events)
    here, turn = run.pose[1:], (run.pose[1:].rotation * target.rotation.inv()).as_rotvec()
    found = np.array(seen)
    np.testing.assert_allclose(found[:, :3] + target.position, here.position, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(found[:, 3:6], turn, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(found[:, 6:12], run.twist[1:], rtol=0.0, atol=1e-6)
    weight = robot.mass * robot.gravity
    np.testing.assert_allclose(weight * found[:, 12:20], np.nan_to_num(run.tensions[1:]), rtol=0.0, atol=1e-4)
    box = robot.test_box
    assert box is not None
    away = np.linalg.norm(here.position - target.position, axis=1) / np.linalg.norm(box.high - box.low)
    np.testing.assert_allclose(rewards, 1.0 - away - 0.2 * np.linalg.norm(turn, axis=1), atol=1e-8)


def test_the_vector_form_gives_the_episodes_of_the_single_one() -> None:
    """Also after the end of an episode; random breaks come from the generator of the environment."""
    settings: dict[str, Any] = {
        "episode_steps": 6, "events": lambda rng: [sl.Break(int(rng.integers(8)), rng.uniform(0.0, 0.05))]
    }  # fmt: skip
    many, actions = robots(3, **settings), np.random.default_rng(2).uniform(-1.0, 1.0, (15, 3, 8))
    rows = [many.reset(seed=10)[0], *(many.step(action)[0] for action in actions)]
    for i in range(3):
        env: Any = gymnasium.make(ID, **settings)
        one, ended = [env.reset(seed=10 + i)[0]], False
        for action in actions[:, i]:
            if ended:
                one.append(env.reset()[0])
                ended = False
                continue
            observation, _, terminated, truncated, _ = env.step(action)
            one.append(observation)
            ended = terminated or truncated
        np.testing.assert_array_equal(np.array(rows)[:, i], one)


def test_lengths_as_actions_lead_to_the_target() -> None:
    """The lengths of the target, given as one action, move the platform there."""
    env: Any = gymnasium.make(ID, action="length", speed=1.0, episode_steps=2000, damping=sl.Damping(loss_time=2e-3))
    robot = sl.load_robot("cogiro")
    start, target = sl.Pose([0.0, 0.0, 2.0]), sl.Pose([0.4, 0.3, 2.2])
    env.reset(options={"start": start, "target": target})
    first, last = (sl.inverse(robot, pose).state.unstrained_length for pose in (start, target))
    action = (last - first) / env.unwrapped._episodes._reach
    for _ in range(1000):
        *_, info = env.step(action)
    assert info["distance"] < 1e-3


def test_a_large_tension_ends_the_episode() -> None:
    env: Any = gymnasium.make(ID, speed=2.0)
    env.reset(seed=3)
    for _ in range(100):
        observation, _, terminated, truncated, _ = env.step(-np.ones(8))
        if terminated:
            break
    assert terminated
    assert not truncated
    robot = sl.load_robot("cogiro")
    assert observation[12:20].max() * robot.mass * robot.gravity > 2.0 * robot.tension_max.min()


@pytest.mark.parametrize(
    ("settings", "parts"),
    [
        ({"robot": sl.load_robot("cogiro").replace(test_box=None)}, ("robot", "without a test box")),
        ({"action": "force"}, ("action", "'force'")),
        ({"speed": -1.0}, ("speed", "-1 m/s", "> 0 m/s, finite")),
        ({"period": 0.0105}, ("dt", "0.0105 s")),
        ({"episode_steps": 0}, ("episode_steps", "0")),
        ({"events": [sl.Brake(0.1)]}, ("events[0]", "Brake", "Break, Stall, Drop or PickUp")),
        ({"events": [sl.Break(9, 0.1)]}, ("events[0]: cable", "9", "0 to 7, as cogiro has")),
    ],
)
def test_invalid_settings_are_refused(settings: dict[str, Any], parts: tuple[str, ...]) -> None:
    with refused(*parts):
        environment.CableRobotEnv(**settings)
    with refused(*parts):
        environment.CableRobotVectorEnv(2, **settings)


def test_invalid_options_of_an_episode_are_refused() -> None:
    env = environment.CableRobotEnv()
    with refused("options", "'begin'"):
        env.reset(options={"begin": [0.0, 0.0, 2.0]})
    with refused("pose"):
        env.reset(options={"start": [0.0, 0.0, 50.0]})


def test_events_of_an_iterator_happen_in_every_episode() -> None:
    env: Any = gymnasium.make(ID, events=iter([sl.Break(2, 0.0)]))
    for _ in range(2):
        env.reset(seed=1)
        observation, *_ = env.step(np.zeros(8))
        assert observation[14] < 1e-6  # tension of cable 2


def test_a_step_before_the_first_reset_is_refused() -> None:
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
        environment.CableRobotVectorEnv(2).step(np.zeros((2, 8)))
    with refused("seed", "3 numbers", "2 numbers, or one"):
        environment.CableRobotVectorEnv(2).reset(seed=[1, 2, 3])
