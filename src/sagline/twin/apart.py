"""A machine in a process of its own, behind its servers, and where its platform really is."""

from __future__ import annotations

import gc
import multiprocessing
import signal
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.twin.machine import Machine
from sagline.twin.server import SCAN, Server

if TYPE_CHECKING:
    from sagline.dynamics.simulator import Reading

SWITCHING_ON: Final = 60.0  # s, at most; kernels may have to be read from the disk


class Apart(NamedTuple):
    """A machine in another process.

    Attributes:
        addresses: "host:port" of each group's PLC.
        place: Shared with it: the true position of the platform's origin [m].
    """

    addresses: tuple[str, ...]
    place: Any

    def position(self) -> Array:
        """Where the platform's origin is after the last scan [m], shape (3,)."""
        return np.array(self.place[:])


@contextmanager
def apart(robot: Robot, nominal: Robot, start: Pose, *, seed: int = 0) -> Iterator[Apart]:
    """Switch a machine on in another process, in real time; it is killed at the end.

    Args:
        robot: The robot as it is.
        nominal: As it was planned.
        start: The pose at which the encoders were set.
        seed: Of noise and clocks.

    Yields:
        The way to it.

    Raises:
        SaglineError: If it cannot be switched on; or it does not answer.
    """
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    place = context.Array("d", 3)
    process = context.Process(target=_serve, args=(robot, nominal, start, seed, there, place), daemon=True)
    process.start()
    there.close()
    try:
        yield Apart(_told(here), place)
    finally:
        process.kill()
        process.join()
        here.close()


def _told(pipe: Connection) -> tuple[str, ...]:
    """The addresses, or why there are none."""
    answer: tuple[str, ...] | SaglineError | None = None
    with suppress(EOFError):
        answer = pipe.recv() if pipe.poll(SWITCHING_ON) else None
    if isinstance(answer, tuple):
        return answer
    if answer is not None:
        raise answer
    step = "Try again; or in this process."
    raise InvalidValueError("the twin's process", "gone, or silent for a minute", "one that answers", step)


def _serve(robot: Robot, nominal: Robot, start: Pose, seed: int, pipe: Connection, place: Any) -> None:
    """Be the machine until killed; Ctrl-C is for the controller, which stops the robot first."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        machine = Machine(robot, nominal=nominal, start=start, seed=seed, period=SCAN)
        server = Server(machine)
    except SaglineError as error:
        pipe.send(error)
        return

    def watch(time: float, reading: Reading) -> None:
        place[:] = reading.position.tolist()

    with closing(server):
        gc.collect()
        gc.freeze()
        pipe.send(tuple(server.addresses))
        server.run(watch)
