"""Planning in another process, because a plan in a thread of the loop's process makes cycles late."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from functools import cache
from io import BytesIO
from queue import SimpleQueue
from threading import Lock, Thread
from typing import IO, Any, Final, TypeVar
from weakref import finalize

from sagline.control.states import RefusedError
from sagline.robot.robot import Robot

T = TypeVar("T")
PIPE: Final = 2**20  # size of the pipes [bytes], so that few reads of an answer disturb the loop
PROGRAM: Final = (
    "import signal, sys; signal.signal(signal.SIGINT, signal.SIG_IGN); sys.path[:] = {path!r}; "
    "from sagline.control.planner import serve; serve()"
)


class Planner:
    """Process that plans for the controllers of this process; it ends with this process."""

    def __init__(self) -> None:
        """Begin without a process; the first request starts one."""
        self._process: subprocess.Popen[bytes] | None = None
        self._robot: Robot | None = None  # last robot that the process received
        self._lock = Lock()

    def submit(self, robot: Robot, work: Callable[[], T]) -> Future[T]:
        """Begin work in the process.

        A robot is sent once. Where work and result contain it, they contain a reference.
        """
        done: Future[T] = Future()
        # a daemon, so that Python ends without the result
        Thread(target=self._fulfill, args=(done, robot, work), name="sagline planning", daemon=True).start()
        return done

    def end(self) -> None:
        """End the process; work in progress is refused, and the next request starts another process."""
        process = self._process
        if process is not None:
            process.kill()
            process.wait()

    def _fulfill(self, done: Future[T], robot: Robot, work: Callable[[], T]) -> None:
        try:
            done.set_result(self._ask(robot, work))
        except Exception as error:
            done.set_exception(error)

    def _ask(self, robot: Robot, work: Callable[[], T]) -> T:
        with self._lock:
            try:
                process = self._started()
                assert process.stdin is not None
                assert process.stdout is not None
                pickle.dump(None if robot is self._robot else robot, process.stdin)
                _Writer(process.stdin, robot).dump(work)
                process.stdin.flush()
                self._robot = robot
                error, found = _Reader(process.stdout, robot).load()
            except (EOFError, OSError, pickle.UnpicklingError) as failure:
                raise self._refusal(failure) from None
            except Exception:  # a part of a message may be in the pipe
                self.end()
                raise
        if error is not None:
            raise error
        result: T = found
        return result

    def _started(self) -> subprocess.Popen[bytes]:
        """Running process."""
        process = self._process
        if process is None or process.poll() is not None:
            self._process = self._robot = None
            self._process = process = subprocess.Popen(
                [sys.executable, "-c", PROGRAM.format(path=list(map(str, sys.path)))],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                pipesize=PIPE,
                start_new_session=True,  # signals to the group of this process do not reach it
            )
            finalize(self, _end, process)
        return process

    def _refusal(self, failure: Exception) -> RefusedError:
        process, self._process = self._process, None
        if process is None:
            return RefusedError("planning", f"no process can be started ({failure})", "Free memory, then try again.")
        _end(process)
        step = "Try again: the next request starts a new process."
        return RefusedError("planning", f"its process has ended with code {process.returncode}", step)


@cache
def planner_of(process: int) -> Planner:
    """Planner of the process with this id; a fork of a process has its own."""
    return Planner()


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a process, and close its pipes."""
    process.kill()
    process.communicate()


class _Writer(pickle.Pickler):
    """Writer of a message with references to the robot."""

    def __init__(self, stream: IO[bytes], robot: Robot) -> None:
        """Write to a stream."""
        super().__init__(stream, pickle.HIGHEST_PROTOCOL)
        self._robot = robot

    def persistent_id(self, obj: object) -> str | None:
        """Reference to the robot; None for any other object."""
        return "robot" if obj is self._robot else None


class _Reader(pickle.Unpickler):
    """Reader of a message with references to the robot."""

    def __init__(self, stream: IO[bytes], robot: Robot) -> None:
        """Read from a stream."""
        super().__init__(stream)
        self._robot = robot

    def persistent_load(self, pid: object) -> Robot:
        """The robot."""
        return self._robot


def _message(robot: Robot, content: object) -> bytes:
    """Whole message, so that an object that cannot be written leaves no part of one in the pipe."""
    stream = BytesIO()
    _Writer(stream, robot).dump(content)
    return stream.getvalue()


def serve() -> None:
    """Answer the requests on stdin until it ends; the result of each, or its error, goes to stdout."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):  # the loop stops the robot first, and may plan in the meantime
        with suppress(AttributeError):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    with suppress(AttributeError, OSError):  # the loop may have a priority in real time
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    answers = sys.stdout.buffer
    sys.stdout = sys.stderr
    requests = SimpleQueue[tuple[Robot, Callable[[], object]]]()
    Thread(target=_listen, args=(requests,), daemon=True).start()
    while True:
        robot, work = requests.get()
        try:
            answer = _message(robot, (None, work()))
        except Exception as error:
            answer = _message(robot, (error, None))
        answers.write(answer)
        answers.flush()


def _listen(requests: SimpleQueue[tuple[Robot, Callable[[], object]]]) -> None:
    """Pass requests on; end this process at once if the other process ends."""
    stream = sys.stdin.buffer
    robot: Any = None
    try:
        while True:
            robot = pickle.load(stream) or robot
            requests.put((robot, _Reader(stream, robot).load()))
    except EOFError:
        os._exit(0)
    except BaseException:
        sys.excepthook(*sys.exc_info())
        os._exit(1)
