"""The five canonical views of an asset: render, lay over a background, and write as PNG."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from asset2sim.assets.surfaces.scene import load_scene, nothing_to_draw
from asset2sim.assets.surfaces.surface import Surface
from asset2sim.render.batch import batches_of, faces_towards
from asset2sim.render.camera import NARROW_FOV, WIDE_FOV, fitted_camera, view_directions
from asset2sim.render.raster import Pixels
from asset2sim.render.renderer import RenderedPicture, render
from asset2sim.storage.regular_files import write_whole
from schemas.base import Vector3
from schemas.settings import ViewSettings

VIEW_NAMES = ("front", "back", "left", "right", "perspective")

STEP, SHARED = 6.0, 0.5
"""Change of grey (0 to 255) between two pixels from which they are an edge, and the share that the four neighbours have
of a pixel at one. TinyRenderer smooths no edges, and its time goes with the pixels: drawn so at the size shown, six
objects differ by 5.6 levels (RMS) from pictures of 16 pixels a pixel, and by 5.5 with 1.5 pixels along each side."""
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
    batches = batches_of(scene.surfaces)
    if not batches:
        raise nothing_to_draw(urdf_file)
    points = np.concatenate([batch.vertices for batch in batches])
    aspect = settings.width / settings.height
    cameras = {
        name: fitted_camera(points, towards, WIDE_FOV if name == "perspective" else NARROW_FOV, aspect)
        for name, towards in view_directions(scene.front).items()
        if name in names
    }
    if len(cameras) == 1:
        batches = faces_towards(batches, next(iter(cameras.values())).eye)
    frames = render(batches, cameras, settings.width, settings.height)
    return {name: smoothed_edges(over_background(frames[name], settings.width, settings.height)) for name in names}


def smoothed_edges(image: Image.Image) -> Image.Image:
    """The picture with the steps of its edges blurred."""
    color = np.asarray(image, dtype=np.float32)
    grey, edge = color.mean(axis=2), np.zeros(color.shape[:2], dtype=bool)
    for level, at in ((grey, edge), (grey.T, edge.T)):
        step = np.abs(np.diff(level, axis=0)) > STEP
        at[1:] |= step
        at[:-1] |= step
    near = np.pad(color, ((1, 1), (1, 1), (0, 0)), mode="edge")
    mean = 0.25 * (near[:-2, 1:-1] + near[2:, 1:-1] + near[1:-1, :-2] + near[1:-1, 2:])
    softer = np.where(edge[..., None], (1.0 - SHARED) * color + SHARED * mean, color)
    return Image.fromarray((softer + 0.5).astype(np.uint8), "RGB")


def over_background(frame: RenderedPicture, width: int, height: int, outlines: Pixels | None = None) -> Image.Image:
    """The frame over the background, averaged down to ``width`` by ``height`` pixels. ``outlines``: (h, w), 0 to 1, how
    strongly each pixel is drawn as an edge: darker, and lighter where it is dark itself."""
    rows = np.linspace(0.0, 1.0, frame.color.shape[0], dtype=np.float32)[:, None, None]
    top, bottom = np.array(BACKGROUND_TOP, dtype=np.float32), np.array(BACKGROUND_BOTTOM, dtype=np.float32)
    color = np.where(frame.drawn[..., None], frame.color, top + rows * (bottom - top))
    if outlines is not None:
        dark = (color.mean(axis=2) < DARK)[..., None]
        color = color + outlines[..., None] * np.where(dark, LIGHTER, -DARKER * color)
    image = Image.fromarray(np.clip(color + 0.5, 0.0, 255.0).astype(np.uint8), "RGB")
    if image.size != (width, height):
        image = image.resize((width, height), Image.Resampling.BOX)
    return image


def png_bytes(image: Image.Image) -> bytes:
    """The picture as a PNG file."""
    stream = io.BytesIO()
    image.save(stream, format="PNG")
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
