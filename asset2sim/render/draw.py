"""Pictures of moving objects: over a floor, with their shadow."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFilter
from scipy.ndimage import uniform_filter

from asset2sim.render.camera import Camera, Singles
from asset2sim.render.faces import Faces
from asset2sim.render.sight import ALIKE, Known, Posed, seen

Picture = NDArray[np.uint8]

WALL, FLOOR = (236.0, 239.0, 243.0), (216.0, 221.0, 228.0)
"""Colours at the top and at the bottom of the background, RGB: light beside white pages, and not glaring on black."""
DISC, DISC_RADIUS = (228.0, 232.0, 238.0), 0.95
"""Colour of the round floor under the object, and its radius as a share of the object's longest edge."""
SHADE, SHADOW, SHADOW_SHRINK = (92, 97, 106), 205, 3
"""Colour of the shadow, its opacity, to 255, and by how much smaller it is drawn before it is blurred."""
SUN = np.array([[0.25], [0.15]])
"""How far the shadow of something moves along x and y for each unit that it is above the floor."""
CREASE, CREASE_DEPTH, CREASE_PIXELS = 0.45, (0.01, 0.07), 5
"""How much darker what lies behind its surroundings is drawn, from and to, units of the world; pixels twice that."""


def pictures(faces: Faces, motions: Singles, camera: Camera, drawn: list[tuple[Singles, Picture]]) -> Iterator[Picture]:
    """An object with its links at (frames, links, 3, 4) transforms to a world in which it is about one unit long and
    the floor is z = 0: (h, w, 3) pictures over a round floor. A frame that is ``drawn`` already, by its (links, 3, 4)
    transforms, is the same picture: a joint comes back as it went, and raw and refined often move alike."""
    ground, known = background(camera, disc=True), Known()
    for motion in motions:
        picture = next((shown for at, shown in drawn if np.abs(motion - at).max() <= ALIKE), None)
        if picture is None:
            picture = over_ground([(faces, motion)], camera, ground, known)
            drawn.append((motion, picture))
        yield picture


def over_ground(objects: Sequence[Posed], camera: Camera, ground: Picture, known: Known | None = None) -> Picture:
    """(h, w, 3) picture of these objects over the ground, with their shadow on the plane z = 0."""
    sight = seen(objects, camera, known)
    below = shadowed(ground, objects, camera).reshape(-1, 3).copy()
    drawn = np.flatnonzero(sight.opacity)
    light = np.float32(1.0) - creases(sight.depth.reshape(ground.shape[:2])).ravel()[drawn, None]
    color = sight.color[drawn] * light + (np.float32(1.0) - sight.opacity[drawn, None]) * below[drawn]
    below[drawn] = np.minimum(color, np.float32(255.0))
    return below.reshape(ground.shape)


def creases(depth: Singles) -> Singles:
    """(h, w) how much darker each pixel is, 0 to 1, for lying behind its surroundings, where light comes less."""
    half = depth[::2, ::2]
    drawn = np.isfinite(half)
    if not drawn.any():
        return np.zeros_like(depth)
    behind = np.where(drawn, half, half[drawn].max())
    least, most = (np.float32(bound) for bound in CREASE_DEPTH)
    deeper = np.clip((behind - uniform_filter(behind, CREASE_PIXELS) - least) / (most - least), 0.0, 1.0)
    deeper[~drawn] = 0.0  # else an edge before the background is dashed
    shade = np.float32(CREASE) * deeper.repeat(2, axis=0).repeat(2, axis=1)
    return np.asarray(shade[: depth.shape[0], : depth.shape[1]])


def background(camera: Camera, *, disc: bool) -> Picture:
    """(h, w, 3) ground of pictures: a gradient, and with ``disc`` a round floor in the plane z = 0 about its origin."""
    share = np.linspace(0.0, 1.0, camera.height, dtype=np.float32)[:, None, None]
    wall, floor = np.array(WALL, dtype=np.float32), np.array(FLOOR, dtype=np.float32)
    image = np.repeat((wall + share * (floor - wall)).astype(np.uint8), camera.width, axis=1)
    if not disc:
        return image
    turn = np.linspace(0.0, 2.0 * np.pi, 97)
    rim = np.stack([DISC_RADIUS * np.cos(turn), DISC_RADIUS * np.sin(turn), 0.0 * turn])
    mask = Image.new("L", (camera.width, camera.height), 0)
    ImageDraw.Draw(mask).polygon([(x, y) for x, y in camera.project(rim)[:2].T.tolist()], fill=255)
    image[np.asarray(mask) > 0] = DISC
    return image


def shadowed(ground: Picture, objects: Sequence[Posed], camera: Camera) -> Picture:
    """The ground with the objects' soft shadow on the plane z = 0."""
    small = camera.magnified(1.0 / SHADOW_SHRINK)
    mask = np.zeros((small.height, small.width), dtype=np.uint8)
    for faces, motion in objects:
        place = np.concatenate([at @ points for at, points in zip(motion, faces.scattered, strict=True)], axis=1)
        place[:2] -= SUN * place[2]
        place[2] = 0.0
        x, y = small.project(place)[:2]
        inside = (x >= 0) & (y >= 0) & (x < small.width) & (y < small.height)
        mask[y[inside].astype(int), x[inside].astype(int)] = SHADOW
    soft = Image.fromarray(mask).filter(ImageFilter.MaxFilter(3)).filter(ImageFilter.GaussianBlur(1.6))
    share = soft.resize((camera.width, camera.height), Image.Resampling.BILINEAR)
    below = Image.fromarray(ground)
    return np.asarray(Image.composite(Image.new("RGB", below.size, SHADE), below, share))
