"""Drawing an asset as it came; for a child process, since it imports an engine and reads files that may crash it."""

from dataclasses import dataclass
from pathlib import Path

from asset2sim.assets.formats.source import open_source
from asset2sim.assets.urdf.reach import Reach
from asset2sim.assets.views import render_views
from asset2sim.assets.views.surface import Surface
from schemas.settings import ViewSettings

OVERSAMPLING = 1.25
"""Pixels drawn per pixel of the picture, along each side: time goes with the square, and WebP takes away the rest."""


@dataclass(frozen=True)
class Before:
    """The picture of an asset as it came: of the folder ``raw``, of what is within ``reach``, into the file ``to``, as
    a WebP of this quality (0 to 100)."""

    raw: Path
    reach: Reach
    to: Path
    quality: int


def draw_before(
    before: Before, loaded: dict[Path, tuple[Surface, ...]] | None = None, urdf: Path | None = None
) -> None:
    """Draw an asset's own files, every joint at zero, from the view that its refined picture has. ``loaded`` remembers
    mesh files already read; ``urdf`` is the asset's own as it is read, if that is known, all of whose files are within
    reach. Raises AssetError."""
    # A URDF that is made is there as long as its source.
    source = open_source(before.raw, reach=before.reach) if urdf is None else None
    urdf = urdf or source.urdf
    picture = render_views(urdf, {}, ViewSettings(), ("perspective",), loaded, OVERSAMPLING)["perspective"]
    picture.save(before.to, quality=before.quality)
