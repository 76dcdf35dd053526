"""Pictures of objects by a camera: the colours of what is nearest, and of what shows through."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asset2sim.assets.surfaces.surface import Bools, Floats, Ints
from asset2sim.physics.arrays import Array
from asset2sim.render.camera import NEAREST, Camera, Singles, camera_axes
from asset2sim.render.faces import INVISIBLE, OPAQUE, Faces

AMBIENT, DIFFUSE = 0.50, 0.52
"""Shares of the ambient and the directed light; a face turned to the lamp shows its own colour."""
LAMP = (-0.35, 0.75, 1.0)
"""The lamp's direction in the camera's frame (right, up, to the viewer): every view is lit alike, from above left."""
LAYERS = 8
"""Translucent surfaces that are looked through, at most."""
BEHIND = 3e-4
"""How far behind a translucent surface the next begins, of the object's size: both sides of a pane are one."""
BESIDE = 3e-6
"""Share of its depth by which a translucent surface lies before an opaque one, or it is hidden: where both are in one
plane either might be met first."""
ALIKE = 1e-3
"""Transforms that differ by less show the same picture: the object is one unit long, and some 200 pixels."""

Posed = tuple[Faces, Array | Singles]
"""An object and (links, 3, 4) transforms of its triangles to the world."""


@dataclass(frozen=True, eq=False)
class Fragments:
    """Pixels of links that move as one: (n,) the ``pixel``, ``depth`` and ``face`` of each, and (n, 4) ``color``,
    0 to 255 in its light, with the opacity, 0 to 1."""

    pixel: Ints
    depth: Singles
    face: Ints
    color: Singles

    def pick(self, chosen: Ints | Bools) -> "Fragments":
        """These of the fragments."""
        return Fragments(*(values[chosen] for values in vars(self).values()))


Known = dict[tuple[int, tuple[int, ...], bytes], Fragments]
"""The fragments of an object's links at a transform."""


@dataclass(frozen=True, eq=False)
class Sight:
    """One picture, flat: (h · w, 3) ``color``, 0 to 255, already times the ``opacity``, 0 to 1 where nothing is drawn,
    ``depth``, inf there, and ``face``, the number of the nearest triangle, -1 there."""

    color: Singles
    opacity: Singles
    depth: Singles
    face: Ints


def standing(faces: Faces) -> Posed:
    """An object as it was read."""
    return faces, np.tile(np.eye(4)[:3], (len(faces.links), 1, 1))


def seen(objects: Sequence[Posed], camera: Camera, known: Known | None = None) -> Sight:
    """The picture of these objects; what is ``known`` of the one before is not looked at again."""
    found: Known = {}
    lamp = np.array(LAMP) @ camera_axes(camera.towards)
    for faces, motion in objects:
        poses: Floats = np.asarray(motion, dtype=np.float64)
        # Rounded, so that what hardly moves is not drawn anew.
        rounded = np.rint(poses / (ALIKE * float(np.linalg.norm(poses[0, :, 0])))).astype(np.int64)
        links = tuple(range(len(faces.links)))
        for group in [links] if (rounded == rounded[0]).all() else [(link,) for link in links]:
            name, pose = (id(faces), group, rounded[group[0]].tobytes()), poses[group[0]]
            found[name] = (known or {}).get(name) or fragments_of(faces, group, pose, camera, lamp)
    if known is not None:
        known.clear()
        known.update(found)
    return layered(list(found.values()), camera.width * camera.height)


def fragments_of(faces: Faces, links: tuple[int, ...], motion: Floats, camera: Camera, lamp: Floats) -> Fragments:
    """The fragments of some links of an object, all at a (3, 4) transform, under a lamp in the (3,) direction."""
    view, parts = camera.moved(motion), []
    around = pixels_around(view, faces, links)
    step = np.float32(BEHIND * faces.size_m * float(np.linalg.norm(motion[:, 0])))
    lamp = lamp @ motion[:, :3]
    lamp = (lamp / np.linalg.norm(lamp)).astype(np.float32)
    for clear in (False, True):
        numbers, triangles = faces.of_links(links, clear)
        side = np.where(view.behind(faces.corners[numbers, 0], faces.flat[numbers]), -1.0, 1.0).astype(np.float32)
        pixel, beyond = around, np.zeros(len(around), np.float32)
        for _ in range(LAYERS if len(numbers) else 0):
            number, weights, depth = triangles.first_hits(view, pixel, beyond)
            met = np.flatnonzero(number >= 0)
            pixel, depth, number = pixel[met], depth[met], number[met]
            face = numbers[number]
            color, normal = faces.looks(face, weights[:, met])
            light = np.maximum((normal @ lamp) * side[number], np.float32(0.0))
            color[:, :3] *= (np.float32(255.0) * (AMBIENT + np.float32(DIFFUSE) * light))[:, None]
            drawn, through = color[:, 3] >= INVISIBLE, color[:, 3] < OPAQUE
            part = Fragments(pixel, depth, face, color)
            parts.append(part if drawn.all() else part.pick(drawn))
            pixel, beyond = pixel[through], depth[through] + step
            if not len(pixel):
                break
    return Fragments(*(np.concatenate(part) for part in zip(*(vars(part).values() for part in parts), strict=True)))


def pixels_around(camera: Camera, faces: Faces, links: tuple[int, ...]) -> Ints:
    """The pixels in which these links may be seen; all where they reach behind the camera."""
    x, y, depth = camera.project(faces.boxes[list(links)].reshape(-1, 3).T)
    (left, right), (top, bottom) = (
        np.clip((np.floor(at.min()), np.ceil(at.max())), 0, side).astype(np.int64)
        for at, side in ((x, camera.width), (y, camera.height))
    )
    if not camera.flat and depth.min() <= NEAREST:
        left, right, top, bottom = np.array([0, camera.width, 0, camera.height])
    return np.asarray(np.arange(top, bottom)[:, None] * camera.width + np.arange(left, right)).ravel()


def layered(parts: Sequence[Fragments], pixels: int) -> Sight:
    """The fragments over each other, in a picture of so many pixels."""
    color, opacity = np.zeros((pixels, 3), np.float32), np.zeros(pixels, np.float32)
    depth, face = np.full(pixels, np.inf, np.float32), np.full(pixels, -1)
    clear = []
    for part in parts:
        through = part.color[:, 3] < OPAQUE
        near = np.flatnonzero(~through & (part.depth < depth[part.pixel]))
        at = part.pixel[near]
        color[at], opacity[at], depth[at], face[at] = part.color[near, :3], 1.0, part.depth[near], part.face[near]
        if through.any():
            clear.append(part.pick(through))
    if not clear:
        return Sight(color, opacity, depth, face)
    left = Fragments(*(np.concatenate(values) for values in zip(*(vars(part).values() for part in clear), strict=True)))
    left = left.pick(left.depth < (1.0 - BESIDE) * depth[left.pixel])
    # The furthest of each pixel, then the next.
    left = left.pick(np.lexsort((-left.depth, left.pixel)))
    while len(left.pixel):
        first = np.diff(left.pixel, prepend=-1) != 0
        now, left = left.pick(first), left.pick(~first)
        at, share = now.pixel, now.color[:, 3]
        color[at] = share[:, None] * now.color[:, :3] + (1.0 - share)[:, None] * color[at]
        opacity[at] = share + (1.0 - share) * opacity[at]
        depth[at], face[at] = now.depth, now.face
    return Sight(color, opacity, depth, face)
