"""Addresses of PLCs as text: names, IPv4 and IPv6, with and without a port."""

from __future__ import annotations

import socket
from contextlib import closing
from ipaddress import IPv6Address

import numpy as np
import pytest

import sagline as sl
from sagline.plc.wire import Address, addresses_of
from tests.plc.samples import sample_blocks, status
from tests.plc.servers import BOTH, PATIENCE, Kind, taken

PORT = 102


def test_every_ipv6_address_is_read_with_and_without_brackets_and_port() -> None:
    random = np.random.default_rng(7)
    for _ in range(300):
        words = random.integers(0, 2**16, 8) * (random.random(8) < 0.6)  # zeros are shortened
        address = IPv6Address(b"".join(int(word).to_bytes(2) for word in words))
        port = int(random.integers(1, 2**16))
        for host in (address.compressed, address.exploded, address.compressed.upper()):
            given = f" {host} ,[{host}],[{host}]:{port}"
            if port == PORT or host == address.exploded:
                given = f"[{host}]:{port}"
                assert addresses_of(given, PORT) == (Address(host, port),)
                continue
            with pytest.raises(sl.InvalidValueError, match="group 1"):  # equal to that of group 0
                addresses_of(given, PORT)
            assert addresses_of(host, PORT) == addresses_of(f"[{host}]", PORT) == (Address(host, PORT),)
            (found,) = addresses_of(f"[{host}]:{port}", PORT)
            assert found == Address(host, port)
            assert addresses_of(str(found), PORT) == (found,)


@pytest.mark.parametrize(
    "text",
    ["[::1", "::1]", "[]", "[]:5", "[::1]5", "[::1]:", "[::1]:0", "[::1]:65536", "[::1]:x", "[[::1]]", "[plc]:5", ":::",
     "1:2:3", "::1:x", "[127.0.0.1]:5", "::g", "[::1]]", "[::1] :5", "a:5:6"],
)  # fmt: skip
def test_invalid_addresses_are_refused(text: str) -> None:
    with pytest.raises(sl.InvalidValueError, match="group 0"):
        addresses_of(text, PORT)


def has_ipv6() -> bool:
    try:
        with socket.create_server(("::1", 0), family=socket.AF_INET6):
            return True
    except OSError:
        return False


@pytest.mark.skipif(not has_ipv6(), reason="this machine has no ::1")
@pytest.mark.parametrize("host", ["::1", "[::1]"])
@pytest.mark.parametrize("kind", BOTH)
def test_a_link_over_ipv6(kind: Kind, host: str) -> None:
    with closing(kind.servers(sample_blocks(status(7)), host)) as servers:  # type: ignore[call-arg]
        assert all(address.startswith("[::1]:") for address in servers.addresses)
        with closing(kind.link(",".join(servers.addresses), 8, timeout=PATIENCE)) as link:
            assert taken(link).counter.tolist() == [7] * 4
