"""Labels of the scene that would cover each other: only the nearer one is drawn, separately for every client."""

from __future__ import annotations

import time
from typing import Final, NamedTuple

import numpy as np
import viser
from scipy.spatial.transform import Rotation
from viser._messages import SetSceneNodeVisibilityMessage

from sagline.core.arrays import Array
from sagline.viewer.camera import Camera
from sagline.viewer.feature import Feature
from sagline.viewer.page import Page

PERIOD: Final = 0.1  # shortest time between two decisions [s]
LETTER: Final = np.array([5.6, 16.0])  # mean width of a letter and height of a line [px]
LAST: Final = ("/axes/", "/names/", "/limits_names/")  # labels that give way to all others, the last ones first
SHARES: Final = {"left": 0.0, "center": 0.5, "right": 1.0, "top": 0.0, "bottom": 1.0}  # of a box before its anchor


class Label(NamedTuple):
    """A visible label of the scene."""

    name: str
    position: Array  # world coordinates [m], shape (3,)
    size: Array  # width and height [px], shape (2,)
    anchor: Array  # shares of the size to the left of the position and above it, shape (2,)

    @property
    def rank(self) -> int:
        """Rank; labels of a lower rank give way."""
        return next((k for k, start in enumerate(LAST) if self.name.startswith(start)), len(LAST))


def visible_labels(scene: viser.SceneApi) -> list[Label]:
    """All visible labels of a scene."""
    nodes = dict(scene._handle_from_node_name)  # viser has no public list of its nodes
    found = []
    for name, node in nodes.items():
        if not isinstance(node, viser.LabelHandle) or not node.visible or not node.text:
            continue
        position = np.asarray(node.position, dtype=np.float64)
        parent = nodes.get(name.rpartition("/")[0])
        if parent is not None:
            if not parent.visible:
                continue
            turn = Rotation.from_quat(np.asarray(parent.wxyz, dtype=np.float64), scalar_first=True)
            position = turn.apply(position) + parent.position
        down, across = node.anchor.split("-")
        size = node.font_screen_scale * LETTER * (len(node.text), 1.0)
        found.append(Label(name, position, size, np.array([SHARES[across], SHARES[down]])))
    return found


def covered(labels: list[Label], camera: Camera) -> frozenset[str]:
    """Names of the labels that are not drawn, because a label of higher rank or a nearer label covers them."""
    if not labels:
        return frozenset()
    places, depths = camera.project(np.stack([each.position for each in labels]))
    corners = places - [each.size * each.anchor for each in labels]
    ends = corners + [each.size for each in labels]
    drawn: list[int] = []
    hidden = set()
    for k in sorted(range(len(labels)), key=lambda k: (-labels[k].rank, depths[k], labels[k].name)):
        if not depths[k] > 0.0:
            continue  # behind the camera
        if drawn and np.any(np.all((corners[k] < ends[drawn]) & (corners[drawn] < ends[k]), axis=1)):
            hidden.add(labels[k].name)
        else:
            drawn.append(k)
    return frozenset(hidden)


class LabelsFeature(Feature):
    """Visibility of the labels in the picture of every client."""

    def __init__(self, page: Page) -> None:
        """Begin with all labels visible."""
        self._server = page.server
        self._hidden: dict[int, frozenset[str]] = {}  # hidden labels of each client
        self._cameras: dict[int, bytes] = {}
        self._decided, self._moving = 0.0, False
        page.server.on_client_disconnect(lambda client: page.later(lambda: self._forget(client.client_id)))

    @property
    def waiting(self) -> bool:
        """True while a camera moves."""
        return self._moving

    def tick(self) -> None:
        """Hide and show labels, at most once per `PERIOD`."""
        if time.monotonic() - self._decided < PERIOD:
            return
        self._decided, self._moving = time.monotonic(), False
        labels = visible_labels(self._server.scene)
        names = {each.name for each in labels}
        for number, client in self._server.get_clients().items():
            camera = Camera.of(client.camera)
            if camera is None:
                continue
            key = camera.axes.tobytes() + camera.place.tobytes() + camera.pixels.tobytes()
            self._moving |= self._cameras.get(number) != key
            self._cameras[number] = key
            hidden = covered(labels, camera)
            before = self._hidden.get(number, frozenset()) & names  # a new label is visible at first
            self._hidden[number] = hidden
            for name in before ^ hidden:  # to this client alone, which viser has no public method for
                client._websock_connection.queue_message(SetSceneNodeVisibilityMessage(name, visible=name in before))

    def _forget(self, client: int) -> None:
        self._hidden.pop(client, None)
        self._cameras.pop(client, None)
