"""Access to a page: the hosts and origins of requests, the token of the address, and limits for clients.

A page of another site in the browser of a user can send requests to this computer. The browser names the other site in
the header Origin. If the domain of the other site leads to this computer (DNS rebinding), the header Host contains this
domain.
"""

from __future__ import annotations

import re
import secrets
import sys
import time
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from hmac import compare_digest
from http import HTTPStatus
from ipaddress import ip_address
from socket import gethostname
from typing import Any, Final

from websockets.asyncio.server import ServerConnection, serve
from websockets.frames import CloseCode
from websockets.http11 import Request, Response

from sagline.core.arguments import brief, elements, flag, instance, whole_number
from sagline.core.errors import InvalidValueError

CLIENTS: Final = 32  # default of the largest number of clients
MOST_CLIENTS: Final = 1000
LARGEST: Final = 65_536  # largest message of a page [B]; the channel sends up to 10,000 characters of up to 4 B
QUIET: Final = 60.0  # after a line about a rejected request, time without a line about the same kind of rejection [s]
_ENTROPY: Final = 16  # size of a token [B]
_HOST: Final = re.compile(r"(?:\[([0-9a-f:.]+)\]|([\w.-]+))(?::[0-9]{1,5})?", re.ASCII)  # name or address, and port

Handler = Callable[[ServerConnection], Awaitable[None]]
Answer = Callable[[ServerConnection, Request], Response | None]


class Access:
    """Access to the page of a server."""

    def __init__(
        self, host: str, *, token: bool = True, clients: int = CLIENTS, allow_host: Sequence[str] = ()
    ) -> None:
        """Make a token, unless every request is answered, which only a trusted host permits."""
        # host: the address on which the server listens; clients: largest number of open pages
        # allow_host: further names of this computer, or of a proxy before it, in the addresses of browsers
        self._clients = whole_number(clients, "clients", 1, MOST_CLIENTS)
        # path: first part of the path of every address, a slash and the token; "" without a token
        self.path = f"/{secrets.token_urlsafe(_ENTROPY)}" if flag(token, "token") else ""
        self._allowed = frozenset(map(_allowed_host, elements(allow_host, str, "allow_host", "Give a list.")))
        own = _host_of(bracketed(host))
        self.local = own is not None and _is_loopback(own)  # True if the server listens on a loopback address
        names = (own, None if self.local else gethostname().lower(), *self._allowed)
        self._names = frozenset(name for name in names if name)
        self._once: set[str] = set()  # paths that can be used once
        self._connected = 0
        self._reported: dict[str, float] = {}  # time of the last line about each kind of rejection [s]
        self.guards = False  # True after the server has begun to check its requests

    def path_once(self) -> str:
        """Path that opens the page a single time; other users of this computer can read a browser's command line."""
        if not self.path:
            return ""
        path = f"/{secrets.token_urlsafe(_ENTROPY)}"
        self._once.add(path)
        return path

    def checked_serve(self, handler: Handler, *place: Any, process_request: Answer, **options: Any) -> serve:
        """`serve` of websockets, with checked requests and limits."""
        self.guards = True

        def answer(connection: ServerConnection, request: Request) -> Response | None:
            try:
                self._check_headers(request)
                if request.path in self._once:
                    self._once.remove(request.path)
                    response = connection.respond(HTTPStatus.SEE_OTHER, "")
                    response.headers["Location"] = self.path
                    return response
                self._remove_token(request)
            except InvalidValueError as error:
                self._report(error)
                return connection.respond(HTTPStatus.FORBIDDEN, f"Refused: {error}\n")
            return process_request(connection, request)

        async def handle(connection: ServerConnection) -> None:
            if self._connected >= self._clients:
                step = "Close a page, or raise --clients."
                error = InvalidValueError("number of pages", self._connected + 1, f"up to {self._clients}", step)
                self._report(error)
                await connection.close(CloseCode.TRY_AGAIN_LATER, str(error))
                return
            self._connected += 1
            try:
                await handler(connection)
            finally:
                self._connected -= 1
                closed = connection.protocol.close_sent
                if closed is not None and closed.code == CloseCode.MESSAGE_TOO_BIG:
                    allowed = f"up to {LARGEST} bytes"
                    self._report(InvalidValueError("message of a page", "too large", allowed, "Reload the page."))

        return serve(handle, *place, process_request=answer, **options | {"max_size": LARGEST})

    def _check_headers(self, request: Request) -> None:
        """Reject requests to another host, or from a page of another origin; only browsers send an origin."""
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        if len(hosts) != 1 or not self._allows(_host_of(hosts[0])):
            step = "Name further hosts with --allow-host."
            raise InvalidValueError("header Host", brief(", ".join(hosts)), "the address of this viewer", step)
        if origins and not (len(origins) == 1 and self._is_own(origins[0], hosts[0])):
            step = "Open the address that the viewer prints."
            raise InvalidValueError("header Origin", brief(", ".join(origins)), "the page of this viewer", step)

    def _remove_token(self, request: Request) -> None:
        """Check the token of a request, and remove it from the path."""
        if self.path:
            given, _, rest = request.path.partition("?")[0][1:].partition("/")
            if not compare_digest(given.encode(errors="replace"), self.path[1:].encode()):
                step = "Open the whole address that the viewer printed at its last start."
                value = "wrong" if given else "missing"
                raise InvalidValueError("token in the address", value, "the token of this viewer", step)
            request.path = f"/{rest}"

    def _allows(self, host: str | None) -> bool:
        """True for a host of this server; any IP address counts, because DNS rebinding needs a name."""
        if host is None:
            return False
        return host in self._names or _is_loopback(host) or (not self.local and _is_address(host))

    def _is_own(self, origin: str, host: str) -> bool:
        """True for the origin of the page: at the requested host, or at an allowed host such as a proxy."""
        scheme, _, place = origin.lower().partition("://")
        return scheme in ("http", "https") and (place == host.lower() or _host_of(place) in self._allowed)

    def _report(self, error: InvalidValueError) -> None:
        """Print a line about `error`, a rejection, unless a rejection of the same kind was printed a short time ago."""
        now = time.monotonic()
        if now - self._reported.get(error.item, -QUIET) >= QUIET:
            self._reported[error.item] = now
            with suppress(OSError):  # if stderr is closed, the line is lost
                print(f"Refused: {error}", file=sys.stderr, flush=True)


def bracketed(host: str) -> str:
    """A name or an address as in a URL."""
    return f"[{host}]" if ":" in host else host


def _host_of(text: str) -> str | None:
    """Name or address in `text`, a header, in lower case without port; None if `text` is invalid."""
    match = _HOST.fullmatch(text.lower())
    if match is None or (match[1] and not _is_address(match[1])):
        return None
    return str(ip_address(match[1])) if match[1] else match[2].rstrip(".") or None


def _is_address(host: str) -> bool:
    try:
        ip_address(host)
    except ValueError:
        return False
    return True


def _is_loopback(host: str) -> bool:
    return host == "localhost" or (_is_address(host) and ip_address(host).is_loopback)


def _allowed_host(text: str) -> str:
    host = _host_of(bracketed(instance(text, str, "allow_host")))
    if host is None:
        step = "Give it without http:// and without a port."
        raise InvalidValueError("--allow-host", brief(text), "a name or an address, lab-pc.example.org", step)
    return host
