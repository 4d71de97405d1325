"""Messages of films and pictures, over a plain websocket."""

import json
from collections.abc import Iterable, Iterator
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from PIL import Image

import sagline as sl
from sagline.viewer.camera import Camera
from sagline.viewer.features import FEATURES
from sagline.viewer.features.export import ExportFeature, Shot, moments
from sagline.viewer.page import Page
from tests.refusal import refused
from tests.tiers import extended
from tests.viewer.client import PATIENCE, Client, await_that
from tests.viewer.shown import PATH, ROBOT, Shown, a_run, framed, handle, shown, tell


@pytest.fixture(scope="module")
def film() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, ROBOT, a_run()))


def rendered(client: Client, message: dict[str, Any], picture: bytes) -> None:
    """Answer what asks for a picture, as a browser would in its own time."""
    client.say(type="GetRenderResponseMessage", payload=picture, render_uuid=message["render_uuid"])


def pixel() -> bytes:
    buffer = BytesIO()
    Image.new("RGB", (1, 1)).save(buffer, "JPEG")
    return buffer.getvalue()


def taking(page: Shown) -> bool:
    return any(visitor.busy.locked() for visitor in tuple(page.viewer.feature(ExportFeature)._exporters.values()))


def said(messages: Iterable[dict[str, Any]], topic: str) -> list[Any]:
    """Contents of messages on a topic."""
    contents = [m.get("props", m.get("updates", {})).get("content", "") for m in messages]
    head = f"sagline:{topic}:"
    return [json.loads(content[len(head) :]) for content in contents if content.startswith(head)]


@extended
def test_a_film_does_not_affect_other_clients(film: Shown) -> None:
    """One client films, gives its pictures slowly, and leaves in the middle; another drags meanwhile."""
    button = handle(film, "Film of the run")
    with Client(film.url) as filming, Client(film.url) as other:
        other.replayed()
        filming.set(button, True)
        first = next(m for m in filming.heard(PATIENCE) if m["type"] == "GetRenderRequestMessage")
        assert (first["width"], first["height"]) == (32, 32)  # names come a picture late
        rendered(filming, first, pixel())
        asked = next(m for m in filming.heard(PATIENCE) if m["type"] == "GetRenderRequestMessage")
        assert (asked["width"], asked["height"]) == (1920, 1080 - 104)
        assert taking(film)
        other.grab()
        other.drag([0.3, 0.7, 2.0])
        await_that(lambda: film.position[1] == 0.7)
        assert taking(film)  # still: the drag has not waited for the film
        heard = []
        for message in other.heard(PATIENCE):
            heard.append(message)
            if message.get("name") == "/cables" and "points" in message.get("updates", {}):
                break
        else:
            raise AssertionError("the drag is not seen")
        heard += other.heard(0.5)
        assert not said(heard, "film")
        assert not any(m["type"] == "GetRenderRequestMessage" for m in heard)
    await_that(lambda: not taking(film))


def test_a_film_is_sent_frame_by_frame_and_can_be_cancelled(film: Shown) -> None:
    button, length = handle(film, "Film of the run"), PATH.time[-1]
    with Client(film.url) as client:
        client.replayed()
        client.set(button, True)
        heard: list[dict[str, Any]] = []
        asked = 0
        for message in client.heard(PATIENCE):
            heard.append(message)
            if message["type"] == "GetRenderRequestMessage":
                asked += 1
                if asked == 5:
                    tell(film, client, "film", "cancel")
                    await_that(
                        lambda: any(
                            v.cancelled.is_set() for v in film.viewer.feature(ExportFeature)._exporters.values()
                        )
                    )
                rendered(client, message, pixel())
            if None in said([message], "film"):
                break
        about = said(heard, "film")
        assert about[0]["count"] == 1 + round(30 * length)
        assert (about[0]["title"], about[0]["remark"], about[0]["legend"]) == (ROBOT.name, "run", "Chord tension [N]")
        assert about[-1] is None
        nothing, *clocks = said(heard, "film clock")
        assert nothing is None  # while the first picture is tried
        times = [float(clock["time"].removesuffix(" s")) for clock in clocks]
        assert times == pytest.approx([0.0, 1 / 30, 2 / 30, 3 / 30], abs=0.005 + 1e-12)  # four, and 32 px
        scene = [m for m in heard if m.get("name") == "/names/0"]
        assert [m["type"] for m in scene][:1] == ["FrameMessage"]  # hidden
        await_that(lambda: not taking(film))
        assert not client.met(film.server).scene._handle_from_node_name


def test_a_film_that_is_too_long_is_refused() -> None:
    with refused("film", allowed="at most 120 s", kind=sl.InvalidValueError) as caught:
        moments(120.0, 0.25)
    assert caught.value.value.startswith("480 s")
    assert moments(2.0, 4.0)[[0, -1]] == pytest.approx([0.0, 2.0])
    assert len(moments(2.0, 4.0)) == 16  # both ends of half a second
    assert len(moments(0.0, 1.0)) == 2


def test_a_picture_is_requested_in_the_size_of_paper(film: Shown) -> None:
    paper, strip, button = handle(film, "Picture for"), handle(film, "With legend"), handle(film, "Picture (PNG)")
    with Client(film.url) as client:
        client.replayed()
        client.set(paper, "Page, 182 mm at 300 dpi")
        client.set(strip, False)
        client.set(button, True)
        heard: list[dict[str, Any]] = []
        asked = []
        for message in client.heard(PATIENCE):
            heard.append(message)
            if message["type"] == "GetRenderRequestMessage":
                asked.append(message)
                rendered(client, message, pixel())
            if None in said([message], "picture"):
                break
        (about, _) = said(heard, "picture")
        assert (about["width"], about["dots"], about["strip"]) == (2148, 300, 0)  # 7.16 in
        assert about["height"] == asked[-1]["height"]
        assert 2148 / 2.4 - 1 <= about["height"] <= 2148 / 0.8 + 1
        assert (asked[-1]["width"], asked[-1]["format"]) == (2148, "image/png")
        gone = {m["name"] for m in heard if m["type"] == "FrameMessage" and not m["props"].get("show_axes", True)}
        assert "/platform" in gone  # the gizmo is a mere frame in this client's scene
        assert "/names/0" in gone
    strip.value = True


@extended
@pytest.mark.parametrize(
    "camera",
    [{"wxyz": [0, 0, 0, 0]}, {"fov": 0.0}, {"fov": -1.0}, {"image_height": 0}, {"position": [0, float("nan"), 0]}],
)
def test_an_invalid_camera_gets_no_picture(film: Shown, camera: dict[str, Any]) -> None:
    with Client(film.url) as client:
        framed(client, film)
        eye: dict[str, Any] = {"wxyz": [1, 0, 0, 0], "up_direction": [0, 0, 1], "position": [0, -20, 3], "fov": 1.0}
        eye |= {"look_at": [0, 0, 0], "near": 0.1, "far": client.far, "image_height": 600, "image_width": 800}
        client.replayed()
        client.say(type="ViewerCameraMessage", **{**eye, **camera})
        client.set(handle(film, "Picture (PNG)"), True)
        messages = client.heard(PATIENCE)
        note = next(m for m in messages if m["type"] in ("NotificationShowMessage", "GetRenderRequestMessage"))
        assert note["type"] == "NotificationShowMessage"
        assert "camera" in str(note)
    await_that(lambda: not taking(film))


def test_a_picture_shows_the_view_of_the_window(film: Shown) -> None:
    """A camera 10 m before a box 2 m deep: nearest face at 9 m, slopes 3/9 and 1/9 of its half width and height."""

    class Seen:
        wxyz = np.array([np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0])  # looks along y, z is up
        position = np.array([0.0, -10.0, 0.0])
        fov, image_width, image_height = 1.0, 500.0, 1000.0

    low, high = np.array([-3.0, -1.0, -1.0]), np.array([3.0, 1.0, 1.0])
    seen: Any = Seen()

    def shot_of(*arguments: Any) -> Shot:
        camera = Camera.of(seen)
        assert camera is not None
        return Shot.of(camera, *arguments)

    seen.image_width = 4000.0
    shot = shot_of(low, high, 1200)
    assert (shot.width, shot.height) == (1200, 500)  # no flatter than 2.4 : 1
    assert np.tan(shot.field / 2.0) == pytest.approx(1.06 * (3.0 / 9.0) / 2.4)
    assert shot.pixel == pytest.approx(2.0 * 10.0 * np.tan(shot.field / 2.0) / shot.height)
    seen.image_width = 500.0  # a narrow window shows less of it
    narrow = shot_of(low, high, 1000, 500)
    assert np.tan(narrow.field / 2.0) == pytest.approx(1.06 * 0.5 * np.tan(0.5) / 2.0)
    seen.image_width = 4000.0  # viser draws nothing beyond 1000 m: the camera goes to where 950 are enough
    seen.position = np.array([0.0, -1000.0, 0.0])
    large = shot_of(100.0 * low, 100.0 * high, 1000, 1000)
    assert large.forward == pytest.approx(1100.0 - 950.0)
    assert np.tan(large.field / 2.0) == pytest.approx(1.06 * 300.0 / 750.0)
    seen.image_width = 500.0
    seen.position = np.zeros(3)  # within the box
    assert np.tan(shot_of(low, high, 1000, 1000).field / 2.0) == pytest.approx(1.06 * np.tan(0.5))
