"""The five canonical views of an asset: render, lay over a background, and write as PNG."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from asset2sim.assets.surfaces.scene import load_scene
from asset2sim.assets.surfaces.surface import Surface
from asset2sim.render.camera import Camera, Singles, view_camera
from asset2sim.render.faces import faces_of
from asset2sim.render.sight import Sight, seen, standing
from asset2sim.storage.regular_files import write_whole
from schemas.base import Vector3
from schemas.settings import ViewSettings

VIEW_NAMES = ("front", "back", "left", "right", "perspective")

OVERSAMPLING = 1.25
"""Pixels drawn per pixel shown, along each side."""
BACKGROUND_TOP, BACKGROUND_BOTTOM = (244.0, 246.0, 249.0), (224.0, 228.0, 234.0)
"""Background colours, RGB: light, and never quite white, so that white objects keep an outline."""
DARK, LIGHTER, DARKER = 70.0, 90.0, 0.75
"""Level (0 to 255) below which a pixel is dark; by how much its edges are lighter; share by which others are darker."""


def render_views(
    urdf_file: Path,
    positions: Mapping[str, float],
    settings: ViewSettings,
    names: Sequence[str] = VIEW_NAMES,
    loaded: dict[Path, tuple[Surface, ...]] | None = None,
    front: Vector3 | None = None,
) -> dict[str, Image.Image]:
    """View name → RGB picture of the asset at these joint positions (radians or metres; joints not named are at zero);
    besides the canonical views there is ``top``. ``loaded`` remembers mesh files already read, ``front`` is where it
    faces (``load_scene``).
    Meshes that are missing are left out. Raises AssetError: unreadable_asset or invalid_joint_configuration if the URDF
    is refused, missing_mesh if nothing is left to draw."""
    scene = load_scene(urdf_file, positions, loaded, front)
    faces = faces_of(scene)
    cameras = {
        name: view_camera(name, faces.points, scene.front, settings.width, settings.height).magnified(OVERSAMPLING)
        for name in names
    }
    return {
        name: over_background(seen([standing(faces)], camera), camera, settings.width, settings.height)
        for name, camera in cameras.items()
    }


def over_background(
    sight: Sight, camera: Camera, width: int, height: int, outlines: Singles | None = None
) -> Image.Image:
    """The camera's picture over the background, averaged down to ``width`` by ``height`` pixels; over empty background
    glass keeps its colour. ``outlines``: (h, w), 0 to 1, how strongly each pixel is drawn as an edge: darker, and
    lighter where it is dark itself."""
    rows = np.linspace(0.0, 1.0, camera.height, dtype=np.float32)[:, None]
    top, bottom = np.array(BACKGROUND_TOP, dtype=np.float32), np.array(BACKGROUND_BOTTOM, dtype=np.float32)
    color = np.repeat(top + rows * (bottom - top), camera.width, axis=0)
    drawn = np.flatnonzero(sight.opacity)
    color[drawn] = sight.color[drawn] / np.maximum(sight.opacity[drawn, None], np.float32(1e-6))
    color = color.reshape(camera.height, camera.width, 3)
    if outlines is not None:
        dark = (color.mean(axis=2) < DARK)[..., None]
        color = color + outlines[..., None] * np.where(dark, LIGHTER, -DARKER * color)
    color += np.float32(0.5)
    image = Image.fromarray(np.clip(color, 0.0, 255.0, out=color).astype(np.uint8), "RGB")
    if image.size != (width, height):
        image = image.resize((width, height), Image.Resampling.HAMMING)
    return image


def png_bytes(image: Image.Image) -> bytes:
    """The picture as a PNG file."""
    stream = io.BytesIO()
    image.save(stream, format="PNG", compress_level=4)  # half the time of 6, and 3 % larger
    return stream.getvalue()


def write_views(
    urdf_file: Path, positions: Mapping[str, float], folder: Path, settings: ViewSettings
) -> tuple[Path, ...]:
    """Render the views into ``folder`` as ``front.png`` and so on; each file appears whole or not at all. Raises what
    ``render_views`` raises, before anything is written."""
    images = render_views(urdf_file, positions, settings)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, image in images.items():
        path = folder / f"{name}.png"
        write_whole(path, png_bytes(image))
        written.append(path)
    return tuple(written)
