"""Where the camera stands so that a box fills the picture, whatever its proportions, and that it stays there."""

from __future__ import annotations

import threading
from typing import Final

import numpy as np
import viser
from scipy.optimize import brentq

from sagline.core.arrays import Array

TOWARD: Final = np.array([0.42, -0.86, 0.36]) / np.linalg.norm([0.42, -0.86, 0.36])  # from the box to the camera
FIELD = 0.7  # rad, of view, upright: a longer lens than viser's bends less
BORDER = 1.06  # of the box, to stay off the edges
_USUAL = 1.3  # width over height until a client has told its own
_MOVED = 1e-3  # of the box: a camera farther from where it was put has been moved by hand
_UP: Final = np.array([0.0, 0.0, 1.0])


def fitted(low: Array, high: Array, aspect: float, field: float = FIELD) -> tuple[Array, Array]:
    """The nearest camera that sees a whole box from the usual side.

    Args:
        low: Lowest corner of the box [m].
        high: Highest corner [m].
        aspect: Width over height of the picture, > 0.
        field: Upright field of view [rad].

    Returns:
        Where the camera is and the point that it looks at [m].
    """
    right = np.cross(_UP, TOWARD)
    right /= np.linalg.norm(right)
    axes = np.stack((right, np.cross(TOWARD, right), -TOWARD))
    middle = 0.5 * (low + high)
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    x, y, depth = axes @ (BORDER * (corners - middle)).T
    slope = np.tan(0.5 * field)
    far = max(_nearest(x, depth, slope * aspect), _nearest(y, depth, slope))
    target = middle + _centered(x, far + depth) * axes[0] + _centered(y, far + depth) * axes[1]
    return target + far * TOWARD, target


def _nearest(place: Array, depth: Array, slope: float) -> float:
    """How far a camera has to stand for points to lie just within both edges: |x - X| = slope (t + z)."""
    return 0.5 * float(np.max(place / slope - depth) + np.max(-place / slope - depth))


def _centered(place: Array, distance: Array) -> float:
    """Where the camera has to look for points to reach as far to one edge as to the other."""

    def off(middle: float) -> float:
        seen = (place - middle) / distance
        return float(seen.max() + seen.min())

    return float(brentq(off, place.min(), place.max(), xtol=1e-9 * float(np.ptp(place))))


class Framing:
    """Keeps a box in the picture of every client that has not moved its camera."""

    def __init__(self, server: viser.ViserServer, low: Array, high: Array) -> None:
        """Aim the cameras of a server's clients, those to come included."""
        self._server = server
        self._low, self._high = low, high
        size = float(np.linalg.norm(high - low))
        self._near = _MOVED * size
        self.farthest = 100.0 * size + float(np.abs([low, high]).max())  # m: no camera is asked for there
        self._places: dict[int, list[Array]] = {}  # where each client's camera has been put
        self._wanted: dict[int, Array] = {}  # what each client that is not known yet looks from and at
        self._led: set[int] = set()  # clients that look from where they were asked to, and are let be
        self._lock = threading.Lock()  # clients' cameras are heard in a pool of threads
        camera = server.initial_camera
        self._first, camera.look_at = fitted(low, high, _USUAL)
        camera.position = self._first
        camera.up, camera.fov = _UP, FIELD
        camera.near, camera.far = 0.002 * size, 20.0 * size
        server.on_client_connect(self._meet)
        server.on_client_disconnect(self._part)

    def look(self, client: int, camera: Array) -> None:
        """Have a client look from a place at another, as if its camera had been moved by hand.

        Args:
            client: Number of the client; one that is not known yet looks from there as soon as it is.
            camera: Both places [m], shape (6,).
        """
        with self._lock:
            self._wanted[client] = camera
            known = self._server.get_clients().get(client)
        if known is not None:
            self._follow(known.camera)

    def moved(self, client: int) -> Array | None:
        """What a client looks from and at [m], shape (6,), if its camera has been moved; None if it has not."""
        known = self._server.get_clients().get(client)
        if known is None:
            return None
        with self._lock:  # a camera that is just being put somewhere has not been moved by hand
            try:
                camera = np.array([known.camera.position, known.camera.look_at], dtype=np.float64).reshape(6)
            except (TypeError, ValueError):
                return None  # nonsense
            places = np.array([self._first, *self._places.get(client, [])])
        still = len(places) == 1 or np.linalg.norm(places - camera[:3], axis=1).min() < self._near
        return None if still or not np.all(np.abs(camera) <= self.farthest) else camera

    def _meet(self, client: viser.ClientHandle) -> None:
        client.camera.on_update(self._follow)
        self._follow(client.camera)

    def _part(self, client: viser.ClientHandle) -> None:
        with self._lock:
            self._places.pop(client.client_id, None)
            self._wanted.pop(client.client_id, None)
            self._led.discard(client.client_id)

    def _follow(self, camera: viser.CameraHandle) -> None:
        """Fit the box anew when the picture has other proportions, unless someone looks from elsewhere."""
        try:
            shape = np.array([camera.image_width, camera.image_height, camera.fov], dtype=np.float64)
            place = np.array(camera.position, dtype=np.float64).reshape(3)
        except (TypeError, ValueError):
            return  # nonsense
        if not (np.all((shape > 0.0) & (shape < [1e5, 1e5, 3.0])) and 0.05 < shape[0] / shape[1] < 20.0):
            return  # a hidden window, or nonsense
        with self._lock:
            self._fit(camera, place, float(shape[0] / shape[1]), float(shape[2]))

    def _fit(self, camera: viser.CameraHandle, place: Array, aspect: float, field: float) -> None:
        places = self._places.setdefault(camera.client.client_id, [])
        wanted = self._wanted.pop(camera.client.client_id, None)
        if wanted is not None:
            places.append(self._first)  # from now on it is where nobody has put it
            self._led.add(camera.client.client_id)
            with camera.client.atomic():
                camera.position, camera.look_at = wanted[:3], wanted[3:]
            return
        if camera.client.client_id in self._led:
            return  # whatever a page that has not heard yet still tells of its camera
        known = np.array([self._first, *places])
        if places and not np.linalg.norm(known - place, axis=1).min() < self._near:
            return
        position, target = fitted(self._low, self._high, aspect, field)
        if camera.client.client_id not in self._server.get_clients():
            return
        stands = bool(np.linalg.norm(position - place) < self._near)
        if not (stands and places):
            places.append(position)
        if stands:
            return
        with camera.client.atomic():
            camera.position, camera.look_at = position, target
