"""The page around the client of viser."""

import re
from html import escape
from pathlib import Path
from urllib.request import urlopen

import viser
from viser import infra

from sagline.viewer.server import ClientFile, page_html, start_server, stop_server

BUILD = Path(viser.__file__).parent / "client" / "build"


def test_the_page_has_its_own_head_and_the_client_of_viser() -> None:
    stock = (BUILD / "index.html").read_text()
    ours = page_html(stock, "<b>robot</b> & co")
    assert re.findall("<title>(.*?)</title>", ours) == [escape("<b>robot</b> & co")]
    assert ours.count('rel="icon"') == 1
    assert "Disconnected" in ours
    head, body = stock.split("</head>", 1)
    assert ours.endswith(body)
    assert head.partition("<script")[2] in ours


def test_only_the_first_page_is_changed(tmp_path: Path) -> None:
    (tmp_path / "other.html").write_bytes(b"<title>Viser</title></head>")
    folder = ClientFile(tmp_path, "robot")
    assert (folder / "other.html").read_bytes() == b"<title>Viser</title></head>"
    assert not (folder / "index.html").is_file()


def test_the_server_serves_the_page_without_changing_viser() -> None:
    stock = infra.WebsockServer
    server = start_server(port=0, title="cogiro <1>")
    try:
        assert infra.WebsockServer is stock
        with urlopen(server.url) as answer:
            (title,) = re.findall("<title>(.*?)</title>", answer.read().decode())
            assert title.startswith(escape("cogiro <1>"))
            assert title.endswith("sagline")
    finally:
        stop_server(server)
