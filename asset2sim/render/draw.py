"""Drawing clouds of points: shaded, over a floor with the object's shadow."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFilter
from scipy.ndimage import uniform_filter

from asset2sim.render.camera import camera_axes
from asset2sim.render.cloud import DIRECTIONS, Cloud
from asset2sim.render.renderer import AMBIENT, DIFFUSE, LAMP
from asset2sim.render.zbuffer import ALIKE, FAR, Layers, Lens, Singles, ranges_moving_together, splat

Picture = NDArray[np.uint8]

WALL, FLOOR = (236.0, 239.0, 243.0), (216.0, 221.0, 228.0)
"""Colours at the top and at the bottom of the background, RGB: light beside white pages, and not glaring on black."""
DISC, DISC_RADIUS = (228.0, 232.0, 238.0), 0.95
"""Colour of the round floor under the object, and its radius as a share of the object's longest edge."""
SHADE, SHADOW, SHADOW_POINTS, SHADOW_SHRINK = (92, 97, 106), 205, 2000, 3
"""Colour of the shadow and its opacity, to 255; the points that cast it; by how much smaller it is drawn before it is
blurred."""
SUN = np.array([0.25, 0.15], dtype=np.float32)
"""How far the shadow of something moves along x and y for each unit that it is above the floor."""
CREASE, CREASE_DEPTH, CREASE_PIXELS = 0.45, (0.01, 0.07), 5
"""How much darker is drawn what lies the deeper behind its surroundings, from and to, units of the world, of twice so
many pixels."""


def pictures(
    cloud: Cloud, motions: Singles, lens: Lens, ground: Picture, drawn: list[tuple[Singles, Picture]] | None = None
) -> Iterator[Picture]:
    """The cloud with its links at (frames, links, 3, 4) transforms from where they are in it to a world in which it is
    about one unit long and the floor is z = 0: (h, w, 4) pictures, red, green, blue and nothing, over the ``ground``.
    Links that never move are drawn once, and a frame that is ``drawn`` already, by its (links, 3, 4) transforms, is the
    same picture: a joint comes back as it went, and raw and refined often move alike."""
    motions, drawn = motions.astype(np.float32), [] if drawn is None else drawn
    still = np.abs(motions - motions[:1]).max(axis=(0, 2, 3)) < ALIKE
    base = Layers.empty(lens)
    for link, first, last in ranges_moving_together(cloud.starts, motions[0], still):
        splat(base, cloud.points, first, last, motions[0][link], lens)
    # An object all of glass has no other points.
    casting = shadow_points(cloud if cloud.starts[-1] or cloud.glass is None else cloud.glass)
    for motion in motions:
        picture = next((known for at, known in drawn if np.abs(motion - at).max() <= ALIKE), None)
        if picture is None:
            layers = base.copy()
            for link, first, last in ranges_moving_together(cloud.starts, motion, ~still):
                splat(layers, cloud.points, first, last, motion[link], lens)
            light = brightness(motion, lens)
            picture = shaded(cloud, layers, light, lens, shadowed(ground, casting, motion, lens))
            if cloud.glass is not None:
                picture = with_translucent(cloud.glass, layers, motion, light, lens, picture)
            drawn.append((motion, picture))
        yield picture


def with_translucent(
    glass: Cloud, behind: Layers, motion: Singles, light: Singles, lens: Lens, picture: Picture
) -> Picture:
    """The picture with translucent points blended over it where they are nearer than what it shows, one layer deep."""
    layers = Layers.empty(lens)
    for link, first, last in ranges_moving_together(glass.starts, motion, np.ones(len(glass.links), dtype=bool)):
        splat(layers, glass.points, first, last, motion[link], lens)
    front = np.where(layers.depth < behind.depth, layers.point, np.int32(-1))
    return shaded(glass, Layers(layers.depth, front), light, lens, picture)


def shaded(cloud: Cloud, layers: Layers, brightness: Singles, lens: Lens, ground: Picture) -> Picture:
    """The z-buffer's points in the light that ``lit`` gives, drawn on the ground, which shows through translucent
    ones."""
    inner = (slice(1, -1), slice(1, -1))
    shape = (lens.height + 2, lens.width + 2)
    point = layers.point.reshape(shape)[inner].ravel()
    place = np.flatnonzero(point >= 0)
    index = point[place]
    light = brightness[cloud.facing[index]]
    light *= np.float32(1.0) - creases(layers.depth.reshape(shape)[inner]).ravel()[place]
    rgba = cloud.colors.view(np.uint32).ravel()[index].view(np.uint8).reshape(-1, 4)
    color = rgba * light[:, None]
    np.minimum(color, np.float32(255.0), out=color)
    if (rgba[:, 3] < 255).any():
        share = rgba[:, 3:].astype(np.float32) / np.float32(255.0)
        color = share * color + (np.float32(1.0) - share) * ground.reshape(-1, 4)[place]
    # Whole pixels: four times as fast as their colours.
    ground.view(np.uint32).ravel()[place] = color.astype(np.uint8).view(np.uint32).ravel()
    return ground


def brightness(motion: Singles, lens: Lens) -> Singles:
    """How brightly a surface of each link is lit that faces either way along each of ``DIRECTIONS``, flat."""
    turn = motion[:, :, :3] / np.maximum(np.linalg.norm(motion[:, :, :1], axis=1, keepdims=True), 1e-9)
    lamp = np.array(LAMP) @ camera_axes(lens.towards.astype(float))
    both = np.stack([lamp / np.linalg.norm(lamp), lens.towards]).astype(np.float32)
    lamps = (both @ turn).reshape(-1, 6)
    # Most links are turned as others are.
    known: dict[bytes, int] = {}
    which = [known.setdefault(row.tobytes(), len(known)) for row in np.rint(1e4 * lamps).astype(np.int32)]
    first = [which.index(number) for number in range(len(known))]
    towards, viewed = np.moveaxis(lamps[first].reshape(-1, 2, 3), 1, 0) @ DIRECTIONS.T
    facing = np.copysign(towards, towards * viewed)
    bright: Singles = np.float32(AMBIENT) + np.float32(DIFFUSE) * np.maximum(facing, np.float32(0.0))
    return bright[which].ravel()


def creases(depth: Singles) -> Singles:
    """(h, w) how much darker each pixel is, 0 to 1, for lying behind its surroundings, where light comes less."""
    half = depth[::2, ::2]
    drawn = half < FAR
    if not drawn.any():
        return np.zeros_like(depth)
    behind = np.where(drawn, half, half[drawn].max())
    least, most = (np.float32(bound) for bound in CREASE_DEPTH)
    deeper = np.clip((behind - uniform_filter(behind, CREASE_PIXELS) - least) / (most - least), 0.0, 1.0)
    shade = np.float32(CREASE) * deeper.repeat(2, axis=0).repeat(2, axis=1)
    return np.asarray(shade[: depth.shape[0], : depth.shape[1]])


def background(lens: Lens, *, disc: bool) -> Picture:
    """(h, w, 4) ground of pictures: a gradient, and with ``disc`` a round floor in the plane z = 0 about its origin."""
    share = np.linspace(0.0, 1.0, lens.height, dtype=np.float32)[:, None, None]
    wall, floor = np.array(WALL, dtype=np.float32), np.array(FLOOR, dtype=np.float32)
    image = np.repeat((wall + share * (floor - wall)).astype(np.uint8), lens.width, axis=1)
    image = np.pad(image, ((0, 0), (0, 0), (0, 1)))
    if not disc:
        return image
    turn = np.linspace(0.0, 2.0 * np.pi, 97)
    rim = np.stack([DISC_RADIUS * np.cos(turn), DISC_RADIUS * np.sin(turn), 0.0 * turn]).astype(np.float32)
    mask = Image.new("L", (lens.width, lens.height), 0)
    ImageDraw.Draw(mask).polygon([(x, y) for x, y in lens.project(rim)[:2].T.tolist()], fill=255)
    image[np.asarray(mask) > 0, :3] = DISC
    return image


def shadow_points(cloud: Cloud, points: int = SHADOW_POINTS) -> tuple[Singles, tuple[int, ...]]:
    """(3, n) points, about so many, that cast the object's shadow, and where those of each link start."""
    stride = max(1, cloud.points.shape[1] // points)
    parts = [cloud.points[:, first:last:stride] for first, last in pairwise(cloud.starts)]
    return np.concatenate(parts, axis=1), (0, *np.cumsum([part.shape[1] for part in parts]).tolist())


def shadowed(ground: Picture, casting: tuple[Singles, tuple[int, ...]], motion: Singles, lens: Lens) -> Picture:
    """A copy of the ground with the soft shadow on the plane z = 0 of the object's ``shadow_points``."""
    points, starts = casting
    everything = np.ones(len(starts) - 1, dtype=bool)
    place = np.concatenate(
        [
            motion[link, :, :3] @ points[:, first:last] + motion[link, :, 3:]
            for link, first, last in ranges_moving_together(starts, motion, everything)
        ],
        axis=1,
    )
    place[:2] -= SUN[:, None] * place[2]
    place[2] = 0.0
    x, y = (lens.project(place)[:2] / SHADOW_SHRINK).astype(np.int32)
    mask = np.zeros((-(-lens.height // SHADOW_SHRINK), -(-lens.width // SHADOW_SHRINK)), dtype=np.uint8)
    inside = (x >= 0) & (y >= 0) & (x < mask.shape[1]) & (y < mask.shape[0])
    mask[y[inside], x[inside]] = SHADOW
    soft = Image.fromarray(mask).filter(ImageFilter.GaussianBlur(1.6))
    picture, box = ground.copy(), soft.getbbox()
    if box is not None:
        left, top, right, bottom = (SHADOW_SHRINK * edge for edge in box)
        part = picture[top:bottom, left:right]
        share = np.asarray(soft.resize((right - left, bottom - top), Image.Resampling.BILINEAR, box), dtype=np.uint16)
        share = share[: part.shape[0], : part.shape[1], None]
        part[:] = (part * (256 - share) + np.array([*SHADE, 0], dtype=np.uint16) * share) >> 8
    return picture


def image_of(picture: Picture) -> Image.Image:
    """A picture as an image without its fourth bytes."""
    height, width = picture.shape[:2]
    return Image.frombuffer("RGB", (width, height), picture.tobytes(), "raw", "RGBX", 0, 1)
