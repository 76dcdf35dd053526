"""Directions and distances of the cameras."""

from dataclasses import dataclass

import numpy as np

from asset2sim.assets.surfaces.surface import Floats, unit_vectors

FILL = 0.85
"""Share of the frame that the object fills along the tighter direction."""
NARROW_FOV = np.radians(10.0)
"""Vertical field of view of the four side views, rad: near to orthographic, so that sizes can be compared."""
WIDE_FOV = np.radians(26.0)
"""Vertical field of view of the perspective view, rad: that of a short telephoto lens."""
CENTERINGS = 3
"""How often distance and centre are adjusted to each other; each round leaves about a tenth of the error."""
UP = np.array([0.0, 0.0, 1.0])
BESIDE_UP = 1e-6
"""How far the top view's camera stands to the front: it says what is up in the picture."""


@dataclass(frozen=True, eq=False)
class Camera:
    """``eye`` and ``target`` (3,) in the root frame, m; vertical ``fov`` in rad; ``near`` and ``far`` planes, m."""

    eye: Floats
    target: Floats
    fov: float
    near: float
    far: float


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


def camera_axes(towards: Floats) -> Floats:
    """(3, 3) rows right, up and backwards (to the viewer) of a camera that stands in the direction ``towards``."""
    right = unit_vectors(np.cross(UP, towards)[None])[0]
    return np.stack([right, np.cross(towards, right), towards])


def fitted_camera(points: Floats, towards: Floats, fov: float, aspect: float) -> Camera:
    """A camera in direction ``towards`` that centres (n, 3) ``points`` and shows them at FILL of its frame. ``aspect``
    is width over height."""
    frame = camera_axes(towards)
    # A row an axis: NumPy takes three times as long for rows of three.
    seen = frame @ points.T
    low, high = seen.min(axis=1), seen.max(axis=1)
    size = float((high - low).max()) or 1.0
    middle = 0.5 * (low + high)
    slope_y = np.tan(0.5 * fov) * FILL
    slope_x = slope_y * aspect
    distance = size
    for _ in range(CENTERINGS):
        across, up, near = seen - middle[:, None]
        reach = near + np.maximum(np.abs(across) / slope_x, np.abs(up) / slope_y)
        distance = max(float(reach.max()), 0.5 * float(high[2] - low[2]) + 0.05 * size)
        # What is nearer looks larger, so the picture's middle is not the box's: look where it is.
        projected = np.stack([across, up]) / (distance - near)
        middle[:2] += 0.5 * distance * (projected.min(axis=1) + projected.max(axis=1))
    target = middle @ frame
    half_depth = 0.5 * float(high[2] - low[2]) + 0.02 * size
    near = max(distance - half_depth, 1e-3 * distance)
    return Camera(target + distance * towards, target, fov, near, distance + half_depth)
