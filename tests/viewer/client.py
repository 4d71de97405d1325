"""A client without a browser that uses the protocol of viser over a plain websocket, and waits for conditions."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from types import TracebackType
from typing import Any

import msgspec.msgpack
import viser
import zstandard
from websockets.sync.client import connect
from websockets.typing import Subprotocol

PATIENCE = 300.0  # s: far more than anything takes, on a busy machine too
LEAVING = 0.5  # s to hear farewell: behind all that was not read it never comes
_MARKS = count(1)


def await_that(done: Callable[[], bool]) -> None:
    """Wait until it is done, which it must be some time."""
    end = time.monotonic() + PATIENCE
    while not done():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


class Client:
    """Connects, drags, sets, and hears what is sent."""

    def __init__(self, address: str) -> None:
        self.far = 100.0 + next(_MARKS)  # m: by which a server knows it from others
        protocol = Subprotocol(f"viser-v{viser.__version__}")
        self.socket = connect(
            address.replace("http", "ws", 1),
            subprotocols=[protocol],
            compression=None,
            max_size=None,
            close_timeout=LEAVING,
        )
        self.look([0, -10, 3], [0, 0, 0])

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.socket.close()

    def say(self, **message: Any) -> None:
        self.send(msgspec.msgpack.encode(message))

    def send(self, raw: bytes | str) -> None:
        self.socket.send(raw)

    def look(self, position: Any, look_at: Any, width: int = 800) -> None:
        """Send the pose of the camera, in a picture 600 px high."""
        eye: dict[str, Any] = {"wxyz": [1, 0, 0, 0], "up_direction": [0, 0, 1]}
        eye |= {"position": [float(x) for x in position], "look_at": [float(x) for x in look_at]}
        lens = {"fov": 1.0, "near": 0.1, "far": self.far, "image_height": 600, "image_width": width}
        self.say(type="ViewerCameraMessage", **eye, **lens)

    def grab(self) -> None:
        self.say(type="TransformControlsDragStartMessage", name="/platform", owner="")

    def drag(self, position: Any, wxyz: Any = (1.0, 0.0, 0.0, 0.0)) -> None:
        self.say(
            type="TransformControlsUpdateMessage",
            name="/platform",
            owner="",
            position=[float(x) for x in position],
            wxyz=[float(x) for x in wxyz],
        )

    def set(self, control: Any, value: Any) -> None:
        """Set a control, given by its handle or its id."""
        uuid = control if isinstance(control, str) else control._impl.uuid
        self.say(type="GuiUpdateMessage", uuid=uuid, updates={"value": value})

    def met(self, server: viser.ViserServer) -> viser.ClientHandle:
        """The data of a server on this client, when they exist."""
        found: list[viser.ClientHandle] = []

        def known() -> bool:
            found[:] = [each for each in server.get_clients().values() if each.camera.far == self.far]
            return bool(found)

        await_that(known)
        return found[0]

    def replayed(self) -> list[dict[str, Any]]:
        """All messages that a server sends to later clients."""
        messages: list[dict[str, Any]] = []
        for message in self.heard():
            if message["type"] == "ReplayDoneMessage":
                return messages
            messages.append(message)
        raise AssertionError("not told all")

    def heard(self, timeout: float = PATIENCE) -> Iterator[dict[str, Any]]:
        """Messages, until none has come for a while [s]."""
        while True:
            try:
                raw = self.socket.recv(timeout=timeout)
            except TimeoutError:
                return
            assert isinstance(raw, bytes)
            size = int.from_bytes(raw[8:16], "little")
            yield from msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(raw[16 : 16 + size]))["messages"]

    def break_off(self) -> None:
        """Leave without a word, as a laptop does that is closed."""
        self.socket.socket.close()


@contextmanager
def clients(address: str, count: int) -> Iterator[list[Client]]:
    """Several clients at once."""
    some = [Client(address) for _ in range(count)]
    try:
        yield some
    finally:
        for client in some:
            client.__exit__(None, None, None)
