"""Batches and cameras in, colours and coverage out: by PyBullet's software renderer, or, where that is not installed,
by one in numpy. No window, no graphics device."""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from asset2sim.assets.surfaces.surface import Batch, DecodedTexture, Texture, decode_textures, unit_vectors
from asset2sim.render.camera import Camera, camera_axes
from asset2sim.render.raster import Bodies, Pixels, rasterize, shade

try:
    import pybullet
except ImportError:
    pybullet = None

INVISIBLE = 0.1
"""Surfaces of a lower opacity than this are not drawn."""
AMBIENT, DIFFUSE = 0.50, 0.52
"""Shares of the ambient and the directed light; a face turned to the lamp shows its own colour."""
SHEEN = 0.07
"""The darkest a colour is drawn, in 0 to 1: even black plastic returns enough light to show its edges."""
LAMP = (-0.35, 0.75, 1.0)
"""The lamp's direction in the camera's frame (right, up, to the viewer): every view is lit alike, from above left."""


@dataclass(frozen=True, eq=False)
class RenderedPicture:
    """One picture: ``color`` (h, w, 3) float 0 to 255, ``drawn`` (h, w) bool, where it shows the object, ``nearness``
    (h, w), one over the distance along the view, 1/m: over a plane it is linear, and 0 where nothing is drawn."""

    color: Pixels
    drawn: NDArray[np.bool_]
    nearness: Pixels


@dataclass(frozen=True, eq=False)
class TranslucentBody:
    """A translucent body: its opacity, 0 to 1, and PyBullet's number of the texture that varies it, or -1."""

    opacity: float
    mask: int


def render(
    batches: Sequence[Batch], cameras: Mapping[str, Camera], width: int, height: int
) -> dict[str, RenderedPicture]:
    """The batches seen by each camera, before any background. TinyRenderer cannot blend: a view in which something
    translucent is seen is drawn again without it, and mixed by its opacity, one layer deep; where a texture varies the
    opacity, a third pass draws that."""
    visible = [batch for batch in batches if batch.paint.color[3] >= INVISIBLE]
    # An exporter that writes an opacity of zero everywhere did not mean an invisible object.
    drawn = visible or list(batches)
    skins = decode_textures(drawn)
    if pybullet is None:
        pictures = {
            key: drawn_by_numpy(drawn, skins, camera, width, height, opaque=not visible)
            for key, camera in cameras.items()
        }
        return {key: picture for key, (picture, _) in pictures.items()}
    client = pybullet.connect(pybullet.DIRECT)
    try:
        with tempfile.TemporaryDirectory(prefix="asset2sim-views-") as name:
            folder = Path(name)
            numbers: dict[int, int] = {}
            glass: dict[int, TranslucentBody] = {}
            for batch in drawn:
                skin = None if batch.paint.texture is None else skins.get(batch.paint.texture)
                body = add_batch(batch, skin, client, folder, numbers)
                opacity = batch.paint.color[3] if visible else 1.0
                mask = None if skin is None or batch.uv is None else skin.opacity
                if opacity < 1.0 or mask is not None:
                    glass[body] = TranslucentBody(
                        opacity, -1 if mask is None else load_texture(mask, client, folder, numbers)
                    )
            shots = {key: take_picture(camera, client, width, height) for key, camera in cameras.items()}
            return blend_translucent(shots, cameras, glass, client)
    finally:
        pybullet.disconnect(client)


def render_bodies(batches: Sequence[Batch], camera: Camera, width: int, height: int) -> tuple[RenderedPicture, Bodies]:
    """The batches in their colours without textures, all opaque, and the (h, w) index of the batch in each pixel, -1
    for none."""
    if pybullet is None:
        return drawn_by_numpy(batches, {}, camera, width, height, opaque=True)
    client = pybullet.connect(pybullet.DIRECT)
    try:
        numbers = {add_batch(batch, None, client, Path(), {}): index for index, batch in enumerate(batches)}
        frame, bodies = take_picture(camera, client, width, height)
    finally:
        pybullet.disconnect(client)
    index = np.full(max(numbers, default=0) + 2, -1, dtype=np.int64)
    for body, number in numbers.items():
        index[body] = number
    return frame, index[bodies]


def drawn_by_numpy(
    batches: Sequence[Batch],
    skins: Mapping[Texture, DecodedTexture],
    camera: Camera,
    width: int,
    height: int,
    *,
    opaque: bool,
) -> tuple[RenderedPicture, Bodies]:
    """One picture, translucent surfaces one layer deep unless all count as ``opaque``, and the (h, w) index of the
    batch in each pixel, -1 for none."""
    lamp = unit_vectors((np.array(LAMP) @ camera_axes(unit_vectors((camera.eye - camera.target)[None])[0]))[None])[0]
    seen = rasterize(batches, camera, width, height)
    color, opacity = shade(batches, skins, (SHEEN, AMBIENT, DIFFUSE), lamp, seen)
    shape = (height, width)
    bodies = seen[0].reshape(shape)
    front = RenderedPicture(color.reshape(*shape, 3), bodies >= 0, seen[3].reshape(shape))
    translucent = np.unique(seen[0][(seen[0] >= 0) & (opacity < 1.0)])
    if opaque or not len(translucent):
        return front, bodies
    clear = [batch for batch in batches if not see_through(batch, skins)]
    empty = RenderedPicture(np.zeros_like(front.color), np.zeros(shape, dtype=bool), np.zeros(shape, np.float32))
    behind = drawn_by_numpy(clear, skins, camera, width, height, opaque=True)[0] if clear else empty
    return blend_pictures(behind, front, opacity.reshape(shape)), bodies


def see_through(batch: Batch, skins: Mapping[Texture, DecodedTexture]) -> bool:
    """Whether a batch is translucent somewhere."""
    skin = None if batch.paint.texture is None else skins.get(batch.paint.texture)
    return batch.paint.color[3] < 1.0 or (batch.uv is not None and skin is not None and skin.opacity is not None)


def add_batch(batch: Batch, skin: DecodedTexture | None, client: int, folder: Path, numbers: dict[int, int]) -> int:
    """Add a batch to the scene; PyBullet's number of its body."""
    color = [*(SHEEN + (1.0 - SHEEN) * level for level in batch.paint.color[:3]), 1.0]
    options: dict[str, object] = {"rgbaColor": color, "physicsClientId": client}
    if skin is not None and batch.uv is not None:
        # TinyRenderer repeats a texture only for coordinates that are not negative.
        options["uvs"] = (batch.uv - np.floor(batch.uv.min(axis=0))).tolist()
    vertices, normals, indices = batch.vertices.tolist(), batch.normals.tolist(), batch.faces.ravel().tolist()
    mesh = {"vertices": vertices, "normals": normals, "indices": indices}
    shape = pybullet.createVisualShape(pybullet.GEOM_MESH, **mesh, **options)
    body = int(pybullet.createMultiBody(0, -1, shape, physicsClientId=client))
    if skin is not None and "uvs" in options:
        set_texture(body, load_texture(skin.color, client, folder, numbers), color, client)
    return body


def set_texture(body: int, texture: int, color: Sequence[float], client: int) -> None:
    """Give a body a texture and a colour."""
    pybullet.changeVisualShape(body, -1, textureUniqueId=texture, rgbaColor=list(color), physicsClientId=client)


def load_texture(image: Image.Image, client: int, folder: Path, numbers: dict[int, int]) -> int:
    """PyBullet's number of a picture, loaded once."""
    if id(image) not in numbers:
        path = folder / f"{len(numbers)}.bmp"
        image.save(path)
        numbers[id(image)] = int(pybullet.loadTexture(str(path), physicsClientId=client))
    return numbers[id(image)]


def take_picture(
    camera: Camera, client: int, width: int, height: int, ambient: float = AMBIENT
) -> tuple[RenderedPicture, Bodies]:
    """One picture, and the (h, w) number of the body in each pixel, -1 for none. At ``ambient`` 1 there is no lamp."""
    lamp = unit_vectors((np.array(LAMP) @ camera_axes(unit_vectors((camera.eye - camera.target)[None])[0]))[None])[0]
    view = pybullet.computeViewMatrix(camera.eye.tolist(), camera.target.tolist(), [0.0, 0.0, 1.0])
    lens = pybullet.computeProjectionMatrixFOV(np.degrees(camera.fov), width / height, camera.near, camera.far)
    light = {"lightDirection": lamp.tolist(), "lightColor": [1.0, 1.0, 1.0], "lightAmbientCoeff": ambient}
    light |= {"lightDiffuseCoeff": DIFFUSE if ambient < 1.0 else 0.0, "lightSpecularCoeff": 0.0, "shadow": 0}
    drawing = {"renderer": pybullet.ER_TINY_RENDERER, "physicsClientId": client}
    answer = pybullet.getCameraImage(width, height, view, lens, **light, **drawing)
    color = np.asarray(answer[2], dtype=np.uint8).reshape(height, width, 4)[..., :3].astype(np.float32)
    bodies = np.asarray(answer[4], dtype=np.int64).reshape(height, width)
    depth = np.asarray(answer[3], dtype=np.float32).reshape(height, width)
    nearness = (camera.far - (camera.far - camera.near) * depth) / (camera.far * camera.near)
    return RenderedPicture(color, bodies >= 0, np.where(bodies >= 0, nearness, 0.0).astype(np.float32)), bodies


def blend_translucent(
    shots: Mapping[str, tuple[RenderedPicture, Bodies]],
    cameras: Mapping[str, Camera],
    glass: Mapping[int, TranslucentBody],
    client: int,
) -> dict[str, RenderedPicture]:
    """The frames with translucent bodies blended over what is behind them."""
    masked = [body for body, item in glass.items() if item.mask >= 0]
    shares: dict[str, Pixels] = {}
    for name, (_, bodies) in shots.items():
        if np.isin(bodies, list(glass)).any():
            shares[name] = np.ones(bodies.shape, dtype=np.float32)
            for body, item in glass.items():
                shares[name][bodies == body] = item.opacity
    for body in masked:
        set_texture(body, glass[body].mask, (1.0, 1.0, 1.0, 1.0), client)
    for name, share in shares.items():
        bodies = shots[name][1]
        seen = np.isin(bodies, masked)
        if seen.any():
            mask, _ = take_picture(cameras[name], client, bodies.shape[1], bodies.shape[0], ambient=1.0)
            share[seen] *= mask.color[..., 0][seen] / 255.0
    for body in glass:
        pybullet.changeVisualShape(body, -1, rgbaColor=(1.0, 1.0, 1.0, 0.0), physicsClientId=client)
    frames = {name: frame for name, (frame, _) in shots.items()}
    for name, share in shares.items():
        behind, _ = take_picture(cameras[name], client, share.shape[1], share.shape[0])
        frames[name] = blend_pictures(behind, frames[name], share)
    return frames


def blend_pictures(behind: RenderedPicture, front: RenderedPicture, share: Pixels) -> RenderedPicture:
    """``share`` (h, w), 0 to 1, of the front picture over the other; over empty background glass keeps its colour."""
    share = np.where(front.drawn & ~behind.drawn & (share > INVISIBLE), 1.0, share)
    color = share[..., None] * front.color + (1.0 - share[..., None]) * behind.color
    nearness = np.where(share > INVISIBLE, front.nearness, behind.nearness)
    return RenderedPicture(color, behind.drawn | (front.drawn & (share > INVISIBLE)), nearness)
