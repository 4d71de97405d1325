"""Gymnasium environment of a cable robot with exact sag: `sagline/CableRobot-v0`, single and vectorized.

Importing this module registers the environment. Each step is one period of `sl.Simulator`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final, Literal, TypeAlias, get_args

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arguments import choice, instance, whole_number
from sagline.core.arrays import Array, Flags, number
from sagline.core.errors import FileError, InvalidValueError
from sagline.dynamics.simulation.results import Break, Drop, Event, PickUp, Stall, checked_events
from sagline.dynamics.simulation.simulator import Simulator
from sagline.dynamics.simulation.winches import Winches
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.files.robot_file import load_robot
from sagline.kinematics.inverse import inverse
from sagline.robot.batch import dead_cable
from sagline.robot.equilibrium import Equilibrium, equilibrium_of
from sagline.robot.robot import Robot

try:
    import gymnasium
    from gymnasium.spaces import Box
    from gymnasium.utils.seeding import np_random
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ImportError:
    raise FileError.not_installed("gymnasium", "The environment needs it", "gymnasium") from None

Actions: TypeAlias = Literal["speed", "length"]
Events: TypeAlias = Event | Iterable[Event] | Callable[[np.random.Generator], Iterable[Event]]

ID: Final = "sagline/CableRobot-v0"
PLACES: Final = 256  # number of random positions from which starts and targets are taken
OVERLOAD: Final = 2.0  # tension that ends an episode, relative to the robot's upper limit
HEAVIEST: Final = 10.0  # tension that ends an episode without such a limit, relative to the platform's weight
BORDER: Final = 0.25  # distance from the box that ends an episode, relative to the box's diagonal
EARTH: Final = 9.81  # gravity in the unit of the tensions if the robot has none [m/s^2]
TURN_COST: Final = 0.2  # reduction of the reward by an error of the rotation [1/rad]


class _Episodes:
    """Episodes of N robots that run at the same time, as arrays with one row per episode."""

    def __init__(
        self,
        count: int,
        robot: Robot | str = "cogiro",
        *,
        action: Actions = "speed",
        speed: float = 0.5,
        period: float = 0.01,
        episode_steps: int = 300,
        events: Events = (),
        winches: Winches = "ideal",
        damping: Damping | None = None,
        step: float | None = None,
    ) -> None:
        """Check the settings; for the arguments see `CableRobotEnv`."""
        self.robot = load_robot(robot) if isinstance(robot, str) else instance(robot, Robot, "robot")
        self._moves: Actions = choice(action, "action", get_args(Actions))
        self._speed, self._period = number(speed, "speed", "m/s", above=0.0), number(period, "period", "s", above=0.0)
        self._last = whole_number(episode_steps, "episode_steps", 1)
        self._events = events if callable(events) else self._supported(events)
        self._options: dict[str, Any] = {"winches": winches, "damping": damping, "step": step}
        self._places = self._feasible_places()
        m, limit = self.robot.cable_count, OVERLOAD * self.robot.tension_max
        self._weight = self.robot.mass * (self.robot.gravity or EARTH)  # unit of the tensions [N]
        self._largest = np.where(np.isfinite(limit), limit, HEAVIEST * self._weight)
        self._reach = float(np.ptp(self._places.unstrained_length, axis=0).max())  # unit of the lengths [m]
        self._shortest = np.nextafter(dead_cable(self.robot), np.inf)  # smallest admissible lengths [m]
        self.observations = Box(-np.inf, np.inf, (12 + 2 * m,), np.float64)
        self.actions = Box(-1.0, 1.0, (m,), np.float64)
        self._machines = [self._machine(self._places[0])] * count
        self._machines[0].step(self._places[0].unstrained_length, self._period)  # refuses invalid periods
        self._coming: list[list[Event]] = [[] for _ in range(count)]
        self._steps = np.zeros(count, dtype=np.int64)
        self._start, self._length, self._tension = (np.zeros((count, m)) for _ in range(3))
        self._target, self._position = np.zeros((count, 3)), np.zeros((count, 3))
        self._turn, self._target_turn, self._twist = (np.zeros((count, size)) for size in (4, 4, 6))
        self._events_of(np.random.default_rng(0), {})  # refuses invalid events

    def _feasible_places(self) -> Equilibrium:
        """Equilibria at random positions in the test box."""
        box = self.robot.test_box
        if box is None:
            step = "Add one: robot.replace(test_box=sl.PoseBox(low, high))."
            raise InvalidValueError("robot", "without a test box", "a robot with a test box", step)
        self._middle, self._size = 0.5 * (box.low + box.high), float(np.linalg.norm(box.high - box.low))
        self._half = 0.5 * (box.high - box.low) + BORDER * self._size
        plan = inverse(self.robot, np.random.default_rng(0).uniform(box.low, box.high, (PLACES, 3)))
        places = np.flatnonzero(plan.feasible)
        if places.size < 2:
            step = "Correct its test box."
            raise InvalidValueError("robot", f"with {places.size} feasible poses in its test box", ">= 2", step)
        return plan.state[places]

    def _machine(self, start: Equilibrium) -> Simulator:
        return Simulator(self.robot, start, integrator="splitting", **self._options)

    def _events_of(self, rng: np.random.Generator, options: Mapping[str, Any]) -> list[Event]:
        """Events of an episode in reverse order."""
        given = options.get("events", self._events)
        return list(reversed(self._supported(given(rng) if callable(given) else given)))

    def _supported(self, events: Event | Iterable[Event]) -> tuple[Event, ...]:
        """Checked events in their order."""
        found = checked_events(events, self.robot, 0.0, self._last * self._period, pieces=False)
        for k, event in enumerate(found):
            if not isinstance(event, Break | Stall | Drop | PickUp):
                step = "Omit it: the actions control the winches."
                raise InvalidValueError(f"events[{k}]", type(event).__name__, "Break, Stall, Drop or PickUp", step)
        return found

    def begin(self, i: int, rng: np.random.Generator, options: Mapping[str, Any]) -> None:
        """Begin an episode in row `i`."""
        for name in options:
            choice(name, "options", ("start", "target", "events"))
        start, target = (self._equilibrium(options.get(item), rng) for item in ("start", "target"))
        self._coming[i], self._machines[i] = self._events_of(rng, options), self._machine(start)
        self._steps[i] = 0
        self._start[i] = self._length[i] = start.unstrained_length
        self._target[i], self._target_turn[i] = target.pose.position, target.pose.quaternion
        self._read(i)

    def _equilibrium(self, pose: Any, rng: np.random.Generator) -> Equilibrium:
        """Equilibrium at `pose`, or at a random position if it is None."""
        return self._places[int(rng.integers(len(self._places)))] if pose is None else equilibrium_of(self.robot, pose)

    def _read(self, i: int) -> None:
        """Copy the true values of a robot to row `i`."""
        reading = self._machines[i].reading
        self._position[i], self._turn[i], self._twist[i] = reading.position, reading.quaternion, reading.twist
        self._tension[i] = reading.tension

    def advance(self, action: Array, running: Flags) -> tuple[Array, Array, Flags, Flags]:
        """Simulate one period of the episodes `running` (N,).

        Returns observations, and rewards, terminations and truncations (N,).
        """
        most, asked = self._speed * self._period, np.clip(action, -1.0, 1.0)
        if self._moves == "length":
            asked = np.clip((self._start + self._reach * asked - self._length) / most, -1.0, 1.0)
        wanted = np.maximum(self._length + most * asked, self._shortest)
        self._length[running] = wanted[running]
        for i in np.flatnonzero(running).tolist():
            while self._coming[i] and self._coming[i][-1].time <= self._steps[i] * self._period:
                _apply(self._machines[i], self._coming[i].pop())
            self._machines[i].step(self._length[i], self._period)
            self._read(i)
        self._steps += running
        seen = self.observe()
        away, turn = (np.linalg.norm(seen[:, part], axis=1) for part in (slice(0, 3), slice(3, 6)))
        outside = (np.abs(self._position - self._middle) > self._half).any(axis=1)
        ended = running & (outside | (self._tension > self._largest).any(axis=1))
        reward = np.where(running, 1.0 - (away / self._size + TURN_COST * turn), 0.0)
        return seen, reward, ended, running & ~ended & (self._steps >= self._last)

    def observe(self) -> Array:
        """Observations, (N, 12 + 2 m)."""
        away, wound = self._position - self._target, (self._length - self._start) / self._reach
        turn = (Rotation.from_quat(self._turn) * Rotation.from_quat(self._target_turn).inv()).as_rotvec()
        return np.concatenate((away, turn, self._twist, self._tension / self._weight, wound), axis=1)

    def info(self) -> dict[str, Array]:
        """Distances from the target [m], (N,)."""
        return {"distance": np.linalg.norm(self._position - self._target, axis=1)}


def _apply(machine: Simulator, event: Event) -> None:
    if isinstance(event, Break):
        machine.cut(event.cable)
    elif isinstance(event, Stall):
        machine.hold(event.winch)
    elif isinstance(event, Drop):
        machine.drop(event.mass)
    elif isinstance(event, PickUp):
        machine.pick_up(event.mass)


class CableRobotEnv(gymnasium.Env[Array, Array]):
    """Environment in which the winches of a cable robot move its platform to a target pose.

    The cables are exact elastic catenaries. An episode begins at rest at a random feasible position in the robot's test
    box; its target is another one. It is truncated after `episode_steps`, and terminated if a tension exceeds twice the
    robot's upper limit (ten times the weight of the platform without a limit), or if the platform leaves the box by
    more than a quarter of its diagonal.

    Observation, shape (12 + 2 m,): position minus target [m], rotation vector from the target's rotation [rad],
    velocity of the origin and angular velocity [m/s, rad/s], tensions at the frame ends relative to the platform's
    weight, and changes of the set points of the lengths since the start, relative to the largest difference of a length
    between two random poses.

    Action, shape (m,), -1 to 1: speeds at which cable is paid out, relative to `speed`. Or lengths, in the unit of the
    observed changes, to which the winches pay out or wind in at `speed` or less.

    Reward per step: 1 - distance from the target / diagonal of the box - 0.2 x angle from the target [rad].

    Actions outside -1 to 1 are clipped, and lengths stay above the dead lengths. An event happens at the begin of
    the first period at or after its time. `reset(options=...)` accepts "start" and "target" (poses) and "events".
    `info["distance"]` is the distance from the target [m].

    Examples:
        >>> import gymnasium
        >>> import sagline as sl
        >>> import sagline.gymnasium
        >>> env = gymnasium.make("sagline/CableRobot-v0", robot="cogiro", events=sl.Break(2, 0.5))
        >>> observation, info = env.reset(seed=1)
        >>> observation, reward, terminated, truncated, info = env.step([0.0] * 8)
        >>> print(observation.shape, terminated)
        (28,) False
    """

    def __init__(self, robot: Robot | str = "cogiro", **settings: Any) -> None:
        """Environment of one robot.

        Args:
            robot: Robot with a test box, or the name of a preset.
            **settings: `action` ("speed" or "length"); `speed`, the largest speed of a winch [m/s], 0.5; `period` of an
                action [s], 0.01; `episode_steps`, 300; `events`: `Break`, `Stall`, `Drop` and `PickUp`, at times since
                the start of the episode, or a function that takes a random generator and returns such events;
                `winches`, `damping` and `step`, same as in `Simulator`, with ideal winches by default.

        Raises:
            FileError: If there is no such preset.
            InvalidValueError: If the robot has no test box or no feasible positions in it, or a setting is invalid.
        """
        self._episodes = _Episodes(1, robot, **settings)
        self.observation_space, self.action_space = self._episodes.observations, self._episodes.actions

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Begin an episode; see the class."""
        super().reset(seed=seed)
        self._episodes.begin(0, self.np_random, options or {})
        return self._episodes.observe()[0], self._info()

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Simulate one period; see the class."""
        seen, reward, ended, truncated = self._episodes.advance(np.asarray(action)[None], np.ones(1, dtype=np.bool_))
        return seen[0], float(reward[0]), bool(ended[0]), bool(truncated[0]), self._info()

    def _info(self) -> dict[str, Any]:
        return {name: float(values[0]) for name, values in self._episodes.info().items()}


class CableRobotVectorEnv(VectorEnv[Array, Array, Any]):
    """N environments as `CableRobotEnv`, in one loop. The step after the end of an episode begins the next one.

    `gymnasium.make_vec("sagline/CableRobot-v0", num_envs=64, vectorization_mode="vector_entry_point")` creates it. An
    integer seed s gives s, s + 1, ... to the environments.
    """

    def __init__(self, num_envs: int = 1, robot: Robot | str = "cogiro", **settings: Any) -> None:
        """Environments of `num_envs` equal robots; for the other arguments see `CableRobotEnv`."""
        self.num_envs = whole_number(num_envs, "num_envs", 1)
        self.metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}
        self._episodes = _Episodes(self.num_envs, robot, **settings)
        self.single_observation_space, self.single_action_space = self._episodes.observations, self._episodes.actions
        self.observation_space, self.action_space = (
            batch_space(space, self.num_envs) for space in (self._episodes.observations, self._episodes.actions)
        )
        self._ended: Flags | None = None
        self._random = [np_random()[0] for _ in range(self.num_envs)]

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin an episode of each environment."""
        if isinstance(seed, int | np.integer):
            seed = [int(seed) + i for i in range(self.num_envs)]
        if seed is not None and len(seed) != self.num_envs:
            step = "Give one seed per environment, or a single one."
            raise InvalidValueError("seed", f"{len(seed)} numbers", f"{self.num_envs} numbers, or one", step)
        for i, given in enumerate(seed or ()):
            if given is not None:
                self._random[i] = np_random(given)[0]
        for i in range(self.num_envs):
            self._episodes.begin(i, self._random[i], options or {})
        self._ended = np.zeros(self.num_envs, dtype=np.bool_)
        return self._episodes.observe(), self._episodes.info()

    def step(self, actions: Array) -> tuple[Array, Array, Flags, Flags, dict[str, Any]]:
        """Simulate one period of all environments; see the class."""
        if self._ended is None:
            raise gymnasium.error.ResetNeeded("The environments have no episodes yet. Call reset() first.")
        for i in np.flatnonzero(self._ended).tolist():
            self._episodes.begin(i, self._random[i], {})
        seen, reward, ended, truncated = self._episodes.advance(np.asarray(actions), ~self._ended)
        self._ended = ended | truncated
        return seen, reward, ended, truncated, self._episodes.info()


if ID not in gymnasium.registry:
    gymnasium.register(
        ID, entry_point=f"{__name__}:CableRobotEnv", vector_entry_point=f"{__name__}:CableRobotVectorEnv"
    )
