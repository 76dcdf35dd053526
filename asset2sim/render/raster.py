"""Pictures of batches in numpy, where PyBullet is not installed: the triangles that a camera sees from their front, by
a z-buffer over all of them at once."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from asset2sim.assets.surfaces.surface import Batch, DecodedTexture, Floats, Ints, Texture, unit_vectors
from asset2sim.render.camera import Camera, camera_axes

Pixels = NDArray[np.float32]
Bodies = NDArray[np.int64]
MOST = 2_000_000
"""Pixels of triangles that are looked at together: 100 MB."""
SAMPLE = (0.0, 1.0)
"""Where in a pixel it is found what is seen there, to the right and down: where PyBullet's renderer does."""
INSIDE = -1e-9
"""Share of a triangle by which a pixel may lie outside it: edges that two share leave no gap."""


def expanded_counts(counts: Ints) -> tuple[Ints, Ints]:
    """For counts 2, 0, 3: the entry of each unit, 0 0 2 2 2, and its number within that, 0 1 0 1 2."""
    entry = np.repeat(np.arange(len(counts)), counts)
    return entry, np.arange(len(entry)) - np.repeat(np.cumsum(counts) - counts, counts)


def rasterize(
    batches: Sequence[Batch], camera: Camera, width: int, height: int
) -> tuple[Bodies, Ints, Floats, NDArray[np.float32]]:
    """Of each pixel, flat: the index of the batch that is seen there, -1 for none, the number of its face in that, the
    (3,) weights of the face's corners, and its nearness, one over the distance along the view, 1/m."""
    towards = unit_vectors((camera.eye - camera.target)[None])[0]
    seen = np.concatenate([batch.vertices[batch.faces].reshape(-1, 3) for batch in batches])
    seen = (seen - camera.eye) @ camera_axes(towards).T
    depth = np.maximum(-seen[:, 2], camera.near)
    focal = 0.5 * height / np.tan(0.5 * camera.fov)
    x = (0.5 * width + focal * seen[:, 0] / depth).reshape(-1, 3)
    y = (0.5 * height - focal * seen[:, 1] / depth).reshape(-1, 3)
    near = (1.0 / depth).reshape(-1, 3)
    # The pixels that may lie in each triangle; those that face away have an area of the other sign.
    area = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    (left, right), (top, bottom) = (
        np.clip((np.ceil(at.min(1) - looked), np.floor(at.max(1) - looked) + 1), 0, side).astype(np.int64)
        for at, looked, side in ((x, SAMPLE[0], width), (y, SAMPLE[1], height))
    )
    counts = np.where(area < 0.0, np.maximum(right - left, 0) * np.maximum(bottom - top, 0), 0)
    number = np.full(width * height, -1, dtype=np.int64)
    weights, buffer = np.zeros((width * height, 3)), np.zeros(width * height)
    ends = np.cumsum(counts)
    first = 0
    while first < len(counts):
        last = max(first + 1, int(np.searchsorted(ends, ends[first] - counts[first] + MOST, side="right")))
        face, place = expanded_counts(counts[first:last])
        face += first
        wide = right[face] - left[face]
        column, row = left[face] + place % wide, top[face] + place // wide
        to_x, to_y = x[face] - (column + SAMPLE[0])[:, None], y[face] - (row + SAMPLE[1])[:, None]
        after, before = [1, 2, 0], [2, 0, 1]
        share = (to_x[:, after] * to_y[:, before] - to_x[:, before] * to_y[:, after]) / area[face, None]
        inside = share.min(axis=1) >= INSIDE
        face, share, pixel = face[inside], share[inside], (row * width + column)[inside]
        nearness = (share * near[face]).sum(axis=1)
        earlier = buffer[pixel]
        np.maximum.at(buffer, pixel, nearness)
        # Of equals the first stays.
        won = np.flatnonzero((nearness == buffer[pixel]) & (nearness > earlier))[::-1]
        number[pixel[won]], weights[pixel[won]] = face[won], share[won]
        first = last
    drawn = number >= 0
    flat = weights[drawn] * near[number[drawn]]
    weights[drawn] = flat / flat.sum(axis=1, keepdims=True)
    starts = np.cumsum([0, *(len(batch.faces) for batch in batches)])
    bodies = np.where(drawn, np.searchsorted(starts, number, side="right") - 1, -1)
    return bodies, number - starts[np.maximum(bodies, 0)], weights, buffer.astype(np.float32)


def shade(
    batches: Sequence[Batch],
    skins: Mapping[Texture, DecodedTexture],
    lit: tuple[float, float, float],
    lamp: Floats,
    seen: tuple[Bodies, Ints, Floats, NDArray[np.float32]],
) -> tuple[Pixels, Pixels]:
    """(n, 3) colours, 0 to 255, and (n,) opacities of what is seen in each pixel, under a lamp in the (3,) direction.
    ``lit`` has the darkest a colour is, and the shares of ambient and directed light."""
    bodies, faces, weights, _ = seen
    sheen, ambient, diffuse = lit
    color, opacity = np.zeros((len(bodies), 3), np.float32), np.zeros(len(bodies), np.float32)
    for index in np.unique(bodies[bodies >= 0]):
        batch, here = batches[index], np.flatnonzero(bodies == index)
        corners, share = batch.faces[faces[here]], weights[here]
        normal = unit_vectors(np.einsum("nc,nck->nk", share, batch.normals[corners]))
        light = ambient + diffuse * np.clip(normal @ lamp, 0.0, 1.0)
        own = np.tile(255.0 * (sheen + (1.0 - sheen) * np.array(batch.paint.color[:3])), (len(here), 1))
        opacity[here] = batch.paint.color[3]
        skin = None if batch.paint.texture is None else skins.get(batch.paint.texture)
        if skin is not None and batch.uv is not None:
            uv = np.einsum("nc,nck->nk", share, batch.uv[corners])
            wide, high = skin.color.size
            at = (np.floor(-uv[:, 1] * high).astype(np.int64) % high, np.floor(uv[:, 0] * wide).astype(np.int64) % wide)
            own *= np.asarray(skin.color)[at] / 255.0
            if skin.opacity is not None:
                opacity[here] *= np.asarray(skin.opacity)[at][:, 0] / 255.0
        color[here] = np.clip(own * light[:, None], 0.0, 255.0)
    return color, opacity
