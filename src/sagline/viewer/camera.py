"""Cameras of clients: automatic framing of the robot, and selection of objects in the picture."""

from __future__ import annotations

import threading
from typing import Any, Final, NamedTuple

import numpy as np
import viser
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.viewer.shapes import box_corners

OUTSIDE: Final = 10.0  # largest coordinate of a point of a picture; (0, 0) is its upper left, (1, 1) its lower right


class Camera(NamedTuple):
    """Position, axes and lens of a camera."""

    place: Array  # position [m], shape (3,)
    axes: Array  # right, down and forward, one per column, shape (3, 3)
    reach: Array  # half the picture's width and height at distance 1, shape (2,)
    pixels: Array  # width and height of the picture [px], shape (2,)

    @classmethod
    def of(cls, camera: Any) -> Camera | None:
        """The camera of a client; None until the client has sent a valid camera."""
        try:
            turn, place = np.asarray(camera.wxyz, dtype=np.float64), np.asarray(camera.position, dtype=np.float64)
            pixels = np.array([camera.image_width, camera.image_height], dtype=np.float64)
            high = float(np.tan(0.5 * camera.fov))
        except (AssertionError, TypeError, ValueError):  # viser asserts that a camera has been sent
            return None
        sound = turn.shape == (4,) and place.shape == (3,) and pixels.min() > 0.0 and high > 0.0
        if not (sound and np.isfinite([*turn, *place, *pixels, high]).all() and np.linalg.norm(turn) > 0.0):
            return None
        axes = Rotation.from_quat(np.roll(turn, -1)).as_matrix()
        return cls(place, axes, high * np.array([pixels[0] / pixels[1], 1.0]), pixels)

    @classmethod
    def of_client(cls, server: viser.ViserServer, client: int) -> Camera | None:
        """Camera of a client by its number; None if it is unknown."""
        found = server.get_clients().get(client)
        return None if found is None else cls.of(found.camera)

    def ray(self, at: ArrayLike) -> Array:
        """Direction to a point of the picture, at a depth of 1, shape (3,)."""
        across, down = self.reach * (2.0 * np.asarray(at) - 1.0)
        return np.asarray(self.axes @ np.array([across, down, 1.0]))

    def sees(self, point: Array) -> bool:
        """True if a point (3,) is in the picture."""
        place, depth = self.project(point)
        return bool(depth > 0.0 and np.all((place >= 0.0) & (place <= self.pixels)))

    def project(self, points: Array) -> tuple[Array, Array]:
        """Picture positions of points (..., 3) [px], shape (..., 2), and depths [m], negative behind the camera."""
        across, down, deep = np.moveaxis((points - self.place) @ self.axes, -1, 0)
        ahead = np.where(deep == 0.0, np.nan, deep)
        flat = np.stack((across / ahead, down / ahead), axis=-1) / self.reach
        return np.asarray(0.5 * (flat + 1.0) * self.pixels), deep

    def nearest_line(self, at: ArrayLike, lines: Array, within: float) -> int | None:
        """Of all `lines` within `within` [px] of the picture point `at`, the line nearest to the viewer; or None."""
        places, deep = self.project(lines)
        start, run = places[:, :-1] - np.asarray(at) * self.pixels, np.diff(places, axis=1)
        length = np.maximum(np.einsum("mpi,mpi->mp", run, run), 1e-12)
        share = np.clip(-np.einsum("mpi,mpi->mp", start, run) / length, 0.0, 1.0)
        away = np.linalg.norm(start + share[..., None] * run, axis=-1)
        ahead = (deep[:, :-1] > 0.0) & (deep[:, 1:] > 0.0)
        away = np.where(ahead & np.isfinite(away), away, np.inf)
        nearest = away.min(axis=1)
        if not nearest.min() <= within:
            return None
        depth = np.take_along_axis(deep, away.argmin(axis=1)[:, None], axis=1)[:, 0]
        as_near = nearest <= nearest.min() + 1.0  # [px], includes cables that cross there
        return int(np.argmin(np.where(as_near, depth, np.inf)))


TOWARD: Final = np.array([0.42, -0.86, 0.36]) / np.linalg.norm([0.42, -0.86, 0.36])  # from the box to the camera
FIELD = 0.7  # vertical field of view [rad], narrower than viser's for less distortion
BORDER = 1.06  # factor on the size of the box, for a margin
_USUAL = 1.3  # ratio of width to height until a client has sent its own
_MOVED = 1e-3  # a camera farther than this from its set position was moved by the user, as a share of the box
_UP: Final = np.array([0.0, 0.0, 1.0])


def fitted(low: Array, high: Array, aspect: float, field: float = FIELD) -> tuple[Array, Array]:
    """Position and target [m] of the camera that is as near as possible and sees a whole box from the usual side."""
    right = np.cross(_UP, TOWARD)
    right /= np.linalg.norm(right)
    axes = np.stack((right, np.cross(TOWARD, right), -TOWARD))
    middle = 0.5 * (low + high)
    x, y, depth = axes @ (BORDER * (box_corners(low, high) - middle)).T
    slope = np.tan(0.5 * field)
    far = max(_nearest(x, depth, slope * aspect), _nearest(y, depth, slope))
    target = middle + _centered(x, far + depth) * axes[0] + _centered(y, far + depth) * axes[1]
    return target + far * TOWARD, target


def _nearest(place: Array, depth: Array, slope: float) -> float:
    """Distance of a camera at which all points are just inside both edges of the picture: |x - X| = slope (t + z)."""
    return 0.5 * float(np.max(place / slope - depth) + np.max(-place / slope - depth))


def _centered(place: Array, distance: Array) -> float:
    """Target of a camera for which the points are centered between both edges."""

    def off(middle: float) -> float:
        seen = (place - middle) / distance
        return float(seen.max() + seen.min())

    return float(brentq(off, place.min(), place.max(), xtol=1e-9 * float(np.ptp(place))))


class Framing:
    """Automatic framing of a box in the picture of every client that has not moved its camera."""

    def __init__(self, server: viser.ViserServer, low: Array, high: Array) -> None:
        """Start automatic framing for present and future clients of a server."""
        self._server = server
        self._low, self._high = low, high
        size = float(np.linalg.norm(high - low))
        self._near = _MOVED * size
        self.farthest = 100.0 * size + float(np.abs([low, high]).max())  # limit of camera positions [m]
        self._places: dict[int, list[Array]] = {}  # set positions of each client's camera
        self._wanted: dict[int, Array] = {}  # position and target for clients that have not connected yet
        self._directed: set[int] = set()  # clients with the camera of a link, without framing
        self._lock = threading.Lock()  # messages of cameras arrive in several threads
        camera = server.initial_camera
        self._first, camera.look_at = fitted(low, high, _USUAL)
        camera.position = self._first
        camera.up, camera.fov = _UP, FIELD
        camera.near, camera.far = 0.002 * size, 20.0 * size
        server.on_client_connect(self._connect)
        server.on_client_disconnect(self._disconnect)

    def look(self, client: int, camera: Array) -> None:
        """Set position and target of the camera of a client; it then counts as moved by the user."""
        with self._lock:
            self._wanted[client] = camera
            known = self._server.get_clients().get(client)
        if known is not None:
            self._follow(known.camera)

    def pan(self, before: Array, after: Array) -> None:
        """After a jump of a point from `before` to `after`, move cameras that have lost sight of it by this vector."""
        for client, known in self._server.get_clients().items():
            camera = Camera.of(known.camera)
            if camera is not None and camera.sees(before) and not camera.sees(after):
                self.look(client, np.concatenate((camera.place, known.camera.look_at)) + np.tile(after - before, 2))

    def moved(self, client: int) -> Array | None:
        """Position and target of the camera of a client [m], shape (6,); None if the user has not moved it."""
        known = self._server.get_clients().get(client)
        if known is None:
            return None
        with self._lock:  # a camera that is being set has not been moved by the user
            try:
                camera = np.array([known.camera.position, known.camera.look_at], dtype=np.float64).reshape(6)
            except (TypeError, ValueError):
                return None  # invalid data
            places = np.array([self._first, *self._places.get(client, [])])
        unmoved = len(places) == 1 or np.linalg.norm(places - camera[:3], axis=1).min() < self._near
        return None if unmoved or not np.all(np.abs(camera) <= self.farthest) else camera

    def _connect(self, client: viser.ClientHandle) -> None:
        client.camera.on_update(self._follow)
        self._follow(client.camera)

    def _disconnect(self, client: viser.ClientHandle) -> None:
        with self._lock:
            self._places.pop(client.client_id, None)
            self._wanted.pop(client.client_id, None)
            self._directed.discard(client.client_id)

    def _follow(self, camera: viser.CameraHandle) -> None:
        """Frame the box again if the picture's proportions change, except for a camera that the user has moved."""
        try:
            shape = np.array([camera.image_width, camera.image_height, camera.fov], dtype=np.float64)
            place = np.array(camera.position, dtype=np.float64).reshape(3)
        except (TypeError, ValueError):
            return  # invalid data
        if not (np.all((shape > 0.0) & (shape < [1e5, 1e5, 3.0])) and 0.05 < shape[0] / shape[1] < 20.0):
            return  # a hidden window, or invalid data
        with self._lock:
            self._fit(camera, place, float(shape[0] / shape[1]), float(shape[2]))

    def _fit(self, camera: viser.CameraHandle, place: Array, aspect: float, field: float) -> None:
        places = self._places.setdefault(camera.client.client_id, [])
        wanted = self._wanted.pop(camera.client.client_id, None)
        if wanted is not None:
            places.append(self._first)  # from now on the camera counts as moved by the user
            self._directed.add(camera.client.client_id)
            with camera.client.atomic():
                camera.position, camera.look_at = wanted[:3], wanted[3:]
            return
        if camera.client.client_id in self._directed:
            return  # the page may still report its previous camera
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
