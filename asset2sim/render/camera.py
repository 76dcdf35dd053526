"""Cameras: where they stand, what they see in each pixel, and the ray of each."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from asset2sim.assets.surfaces.surface import Bools, Floats, Ints, unit_vectors

Singles = NDArray[np.float32]

FILL = 0.85
"""Share of the frame that the object fills along the tighter direction."""
NARROW_FOV, WIDE_FOV, FILM_FOV = np.radians(10.0), np.radians(26.0), np.radians(24.0)
"""Vertical fields of view, rad: of the four side views, near to orthographic, so that sizes can be compared; of the
perspective view, that of a short telephoto lens; and of films."""
CENTERINGS = 3
"""How often distance and centre are adjusted to each other; each round leaves about a tenth of the error."""
UP = np.array([0.0, 0.0, 1.0])
BESIDE_UP = 1e-6
"""How far the top view's camera stands to the front: it says what is up in the picture."""
NEAREST = 1e-3
"""Depth at which what is behind the camera is projected, in units of the world."""


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera for pictures of ``width`` by ``height`` pixels. ``matrix`` (3, 4) takes a point of the world to
    (x · depth, y · depth, depth), x to the right and y down in pixels; where it is ``flat``, an orthographic one, to
    (x, y, depth). ``towards`` (3,) is the direction to the viewer, in the world."""

    matrix: Floats
    width: int
    height: int
    towards: Floats
    flat: bool = False

    def project(self, points: Floats) -> Floats:
        """(3, n) points of the world as x, y (pixels) and depth."""
        seen = self.matrix[:, :3] @ points + self.matrix[:, 3:]
        if not self.flat:
            seen[:2] /= np.maximum(seen[2], NEAREST)
        return np.asarray(seen)

    def moved(self, motion: Floats) -> "Camera":
        """The same view of points that a (3, 4) transform takes to the world."""
        return replace(self, matrix=self.matrix @ np.concatenate([motion, [[0.0, 0.0, 0.0, 1.0]]]))

    def magnified(self, factor: float) -> "Camera":
        """The same view in a picture that is larger by this factor."""
        width, height = round(self.width * factor), round(self.height * factor)
        return replace(self, matrix=self.matrix * [[factor], [factor], [1.0]], width=width, height=height)

    @cached_property
    def _inverse(self) -> Floats:
        return np.asarray(np.linalg.inv(self.matrix[:, :3]), dtype=np.float64)

    def rays(self, pixel: Ints) -> tuple[Floats, Singles]:
        """(3,) or (n, 3) origins and (n, 3) directions of the rays through the middles of these pixels, numbered row by
        row; a point's depth is how many directions it is from the origin."""
        columns, rows = (
            (np.arange(count) + 0.5)[:, None] * self._inverse[:, axis]
            for axis, count in enumerate((self.width, self.height))
        )
        start, along = -self._inverse @ self.matrix[:, 3], self._inverse[:, 2]
        row = pixel // self.width
        column = pixel - row * self.width
        if self.flat:
            plane = columns[column] + rows[row] + start
            return plane, np.broadcast_to(along.astype(np.float32), plane.shape)
        found = columns.astype(np.float32).take(column, axis=0)
        found += (rows + along).astype(np.float32).take(row, axis=0)
        return start, found

    def behind(self, points: Floats, normals: Floats) -> Bools:
        """(m,) whether the camera sees triangles at these (m, 3) points with these normals from behind."""
        if self.flat:
            return np.asarray(normals @ self._inverse[:, 2] > 0.0)
        eye = -self._inverse @ self.matrix[:, 3]
        return np.asarray(np.einsum("mj,mj->m", normals, points - eye) > 0.0)

    @property
    def focal(self) -> float:
        """Pixels that a metre takes at a depth of one; at any depth where it is ``flat``."""
        return float(np.linalg.norm(np.cross(self.matrix[0, :3], self.matrix[2, :3])))


def view_directions(front: Floats) -> dict[str, Floats]:
    """View name → (3,) unit vector from the object to the camera, its front facing ``front``, z up. Left and right are
    those of a viewer who faces the front. The perspective view is from front and right, 30° up; the top view has the
    front at its lower edge."""
    left = np.cross(front, UP)
    elevation, azimuth = np.radians(30.0), np.radians(35.0)
    level = np.cos(azimuth) * front - np.sin(azimuth) * left
    return {
        "front": front,
        "back": -front,
        "left": left,
        "right": -left,
        "top": unit_vectors((UP + BESIDE_UP * front)[None])[0],
        "perspective": np.cos(elevation) * level + np.sin(elevation) * UP,
    }


def view_camera(name: str, points: Floats, front: Floats, width: int, height: int) -> Camera:
    """The camera of a view by its name, for (n, 3) points."""
    fov = WIDE_FOV if name == "perspective" else NARROW_FOV
    return fitted_camera(points, view_directions(front)[name], fov, width, height)


def camera_axes(towards: Floats, up: Floats = UP) -> Floats:
    """(3, 3) rows right, up and backwards (to the viewer) of a camera that stands in the direction ``towards``."""
    right = unit_vectors(np.cross(up, towards)[None])[0]
    return np.stack([right, np.cross(towards, right), towards])


def fitted_camera(points: Floats, towards: Floats, fov: float, width: int, height: int) -> Camera:
    """A camera in direction ``towards`` that centres (n, 3) ``points`` and shows them at FILL of its frame; ``fov`` is
    its vertical field of view, rad."""
    frame = camera_axes(towards)
    # A row an axis: NumPy takes three times as long for rows of three.
    seen = frame @ points.T
    low, high = seen.min(axis=1), seen.max(axis=1)
    size = float((high - low).max()) or 1.0
    middle = 0.5 * (low + high)
    slope_y = np.tan(0.5 * fov) * FILL
    slope_x = slope_y * width / height
    distance = size
    for _ in range(CENTERINGS):
        across, up, near = seen - middle[:, None]
        reach = near + np.maximum(np.abs(across) / slope_x, np.abs(up) / slope_y)
        distance = max(float(reach.max()), 0.5 * float(high[2] - low[2]) + 0.05 * size)
        # What is nearer looks larger, so the picture's middle is not the box's: look where it is.
        projected = np.stack([across, up]) / (distance - near)
        middle[:2] += 0.5 * distance * (projected.min(axis=1) + projected.max(axis=1))
    right, up, back = frame
    focal = 0.5 * height / np.tan(0.5 * fov)
    rows = np.stack([focal * right - 0.5 * width * back, -focal * up - 0.5 * height * back, -back])
    eye = middle @ frame + distance * towards
    return Camera(np.concatenate([rows, -(rows @ eye)[:, None]], axis=1), width, height, towards)
