"""Access to the page over real sockets, as by browsers on foreign pages and by other clients."""

import http.client
import json
import socket
from collections.abc import Iterator
from typing import Any

import pytest
import viser
from websockets.asyncio.server import serve
from websockets.exceptions import ConnectionClosed

import sagline as sl
from sagline.viewer import access
from sagline.viewer.server import LONGEST, NAME, Channel, PageServer, start_server, stop_server
from tests.refusal import refused
from tests.viewer.client import PATIENCE, Client, await_that
from tests.viewer.shown import handle

FOREIGN = "evil.example"
UPGRADE = {
    "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Protocol": f"viser-v{viser.__version__}",
}  # fmt: skip
BOTH = pytest.mark.parametrize(("extra", "served"), [({}, 200), (UPGRADE, 101)], ids=["http", "websocket"])


@pytest.fixture
def made(request: pytest.FixtureRequest) -> Iterator[PageServer]:
    """A server with the arguments that a test gives."""
    server = start_server(port=0, **getattr(request, "param", {}))
    yield server
    stop_server(server)


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    one = start_server(port=0)
    yield one
    stop_server(one)


def asked(server: PageServer, path: str, *hosts: str, **headers: str) -> tuple[int, str, str]:
    """Status, body and place of an answer; PORT in a header is that of the server, and _ in a name is a hyphen."""
    port = str(server.get_port())
    lines = [f"GET {path} HTTP/1.1", *(f"Host: {host}" for host in hosts or ("127.0.0.1:PORT",))]
    lines += [f"{name.replace('_', '-')}: {value}" for name, value in headers.items()]
    with socket.create_connection(("127.0.0.1", int(port)), timeout=PATIENCE) as connection:
        connection.sendall("\r\n".join([*lines, "", ""]).replace("PORT", port).encode("latin-1"))
        answer = http.client.HTTPResponse(connection)
        answer.begin()
        body = "" if answer.status == 101 else answer.read().decode()
        return answer.status, body, answer.headers.get("Location", "")


@BOTH
def test_the_address_contains_the_token(server: PageServer, extra: dict[str, str], served: int) -> None:
    path = server.access.path
    assert len(path) > 20
    assert server.url == f"http://127.0.0.1:{server.get_port()}{path}"
    assert asked(server, path, **extra)[0] == served
    assert asked(server, f"{path}/", **extra)[0] == served
    for wrong in ("/", "/index.html", path[:-1], f"{path}x", f"//{path}", f"/?token={path[1:]}", f"/x{path}", "/\xe9"):
        status, body, _ = asked(server, wrong, **extra)
        assert (status, body.partition(":")[0]) == (403, "Refused"), wrong
        assert path[1:] not in body


def test_each_server_has_its_own_token(server: PageServer, made: PageServer) -> None:
    assert asked(made, server.access.path)[0] == 403


@BOTH
def test_a_rebound_host_is_refused(server: PageServer, extra: dict[str, str], served: int) -> None:
    path = server.access.path
    for own in ("127.0.0.1:PORT", "localhost:PORT", "LOCALHOST:9000", "[::1]:PORT", "127.0.0.2", "localhost."):
        assert asked(server, path, own, **extra)[0] == served, own
    others = (
        FOREIGN, f"{FOREIGN}:PORT", "localhost.evil.example:PORT", "localhost:PORT.evil.example", "192.0.2.1:PORT",
        "evil.example@localhost:PORT", "[::2]:PORT", "[localhost]", "0.0.0.0:PORT", "",
    )  # fmt: skip
    for other in others:
        status, body, _ = asked(server, path, other, **extra)
        assert (status, "Host" in body) == (403, True), other
    assert asked(server, path, "localhost:PORT", FOREIGN, **extra)[0] == 403


@BOTH
def test_a_foreign_page_is_refused(server: PageServer, extra: dict[str, str], served: int) -> None:
    path = server.access.path
    assert asked(server, path, Origin="http://127.0.0.1:PORT", **extra)[0] == served
    others = (
        f"http://{FOREIGN}", "http://127.0.0.1:1", "http://localhost:PORT", "https://127.0.0.1", "null", "",
        "file://127.0.0.1:PORT", "127.0.0.1:PORT", "http://127.0.0.1:PORT@evil.example", "http://127.0.0.1:PORT/",
    )  # fmt: skip
    for other in others:
        status, body, _ = asked(server, path, Origin=other, **extra)
        assert (status, "Origin" in body) == (403, True), other


@BOTH
@pytest.mark.parametrize("made", [{"token": False}], indirect=True)
def test_hosts_and_origins_are_checked_without_a_token(made: PageServer, extra: dict[str, str], served: int) -> None:
    assert made.url == f"http://127.0.0.1:{made.get_port()}"
    assert made.access.path_once() == ""
    assert asked(made, "/", **extra)[0] == served
    assert asked(made, "/", Origin="http://127.0.0.1:PORT", **extra)[0] == served
    assert asked(made, "/", f"{FOREIGN}:PORT", **extra)[0] == 403
    assert asked(made, "/", f"{FOREIGN}:PORT", Origin=f"http://{FOREIGN}:PORT", **extra)[0] == 403
    assert asked(made, "/", Origin=f"http://{FOREIGN}", **extra)[0] == 403


@BOTH
@pytest.mark.parametrize("made", [{"allow_host": ["Lab.example", "::2"]}], indirect=True)
def test_an_allowed_host_is_accepted_also_as_a_proxy(made: PageServer, extra: dict[str, str], served: int) -> None:
    path = made.access.path
    assert asked(made, path, "lab.example", Origin="https://lab.example", **extra)[0] == served
    assert asked(made, path, "[0:0::2]:80", **extra)[0] == served
    assert asked(made, path, Origin="https://lab.example:8443", **extra)[0] == served
    assert asked(made, path, "x.lab.example", **extra)[0] == 403
    assert asked(made, path, Origin="https://x.lab.example", **extra)[0] == 403


@BOTH
@pytest.mark.parametrize("made", [{"host": "0.0.0.0"}], indirect=True)
def test_on_all_addresses_any_address_and_the_host_name_are_accepted(
    made: PageServer, extra: dict[str, str], served: int
) -> None:
    assert made.url.startswith(f"http://localhost:{made.get_port()}/")
    assert not made.access.local
    for own in ("192.0.2.1:PORT", "[2001:db8::1]", "localhost:PORT", socket.gethostname()):
        assert asked(made, made.access.path, own, **extra)[0] == served, own
    assert asked(made, made.access.path, f"{FOREIGN}:PORT", **extra)[0] == 403
    assert asked(made, "/", "192.0.2.1:PORT", **extra)[0] == 403


@pytest.mark.parametrize("wrong", [["http://lab.example"], ["lab.example:80"], [""], ["*"], "a b", [1], 1])
def test_invalid_host_names_are_refused(wrong: Any) -> None:
    with pytest.raises(sl.InvalidValueError, match="host"):
        start_server(port=0, allow_host=wrong)
    with refused("clients", "0", "1 to 1000", kind=sl.InvalidValueError):
        start_server(port=0, clients=0)


@BOTH
def test_a_browser_is_started_with_an_address_that_works_once(
    server: PageServer, extra: dict[str, str], served: int
) -> None:
    once = server.access.path_once()
    assert server.access.path not in once
    assert asked(server, once, f"{FOREIGN}:PORT", **extra)[0] == 403
    assert asked(server, once, **extra) == (303, "", server.access.path)
    assert asked(server, once, **extra)[0] == 403


@pytest.mark.parametrize("made", [{"clients": 2}], indirect=True)
def test_too_many_pages_are_refused_until_one_is_closed(made: PageServer, capsys: pytest.CaptureFixture[str]) -> None:
    with Client(made.url) as first:
        with Client(made.url) as second:
            assert first.replayed()
            assert second.replayed()
            for _ in range(2):
                with pytest.raises(ConnectionClosed) as caught, Client(made.url) as third:
                    list(third.heard())
                assert caught.value.rcvd is not None
                assert caught.value.rcvd.code == 1013
                assert "up to 2." in caught.value.rcvd.reason
            assert asked(made, made.access.path)[0] == 200
        await_that(lambda: len(made.get_clients()) == 1)
        with Client(made.url) as third:
            assert third.replayed()
    assert capsys.readouterr().err.count("Refused: ") == 1


def test_a_message_larger_than_any_of_the_page_ends_its_client(
    server: PageServer, capsys: pytest.CaptureFixture[str]
) -> None:
    with Client(server.url) as good:
        for size, cut in ((access.LARGEST, False), (access.LARGEST + 1, True)):
            with Client(server.url) as bad:
                assert bad.replayed()
                bad.say(type="Nothing", value="x" * (size - 23))  # which ends a client too, in its own way
                with pytest.raises(ConnectionClosed) as caught:
                    list(bad.heard())
                assert (caught.value.rcvd is not None and caught.value.rcvd.code == 1009) is cut
        assert good.replayed()
    said = [""]

    def is_complete() -> bool:
        said.append(capsys.readouterr().err)
        return "".join(said).endswith("\n")

    await_that(is_complete)  # the server writes after the client has ended
    lines = "".join(said).splitlines()
    assert [str(access.LARGEST) in line for line in lines if line.startswith("Refused: ")] == [True]


def test_the_largest_message_of_a_page_is_accepted(made: PageServer) -> None:
    channel, heard = Channel(made.gui, lambda task: task()), list[Any]()
    channel.on("test", lambda value, _: heard.append(value))
    text = "\U0001d11e" * (LONGEST - 40)
    with Client(made.url) as client:
        client.set(handle(made, NAME), json.dumps({"topic": "test", "value": text}, ensure_ascii=False))
        await_that(lambda: heard == [text])


def test_an_endless_request_is_refused(server: PageServer) -> None:
    with pytest.raises((http.client.HTTPException, OSError)):
        asked(server, f"/{'x' * 20_000}")
    with pytest.raises((http.client.HTTPException, OSError)):
        asked(server, server.access.path, **{f"X-{k}": "x" for k in range(200)})


def test_refusals_of_a_kind_are_printed_once_a_minute(
    made: PageServer, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for _ in range(3):
        asked(made, "/")
        asked(made, made.access.path, f"{FOREIGN}\xff")
        asked(made, made.access.path, Origin=f"http://{FOREIGN}")
    told = capsys.readouterr().err
    assert (told.count("\n"), told.count(FOREIGN), told.count("token")) == (3, 2, 2)
    assert made.access.path not in told
    assert told.isascii()
    monkeypatch.setattr(access, "QUIET", 0.0)
    asked(made, "/")
    assert capsys.readouterr().err.count("\n") == 1


def test_an_unsupported_version_of_viser_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(access.Access, "checked_serve", lambda _, *place, **options: serve(*place, **options))
    with refused("viser", viser.__version__, kind=sl.InvalidValueError):
        start_server(port=0)
