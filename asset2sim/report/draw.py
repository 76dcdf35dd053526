"""Drawing an asset as it came; for a child process, since it imports an engine and reads files that may crash it."""

from dataclasses import dataclass
from pathlib import Path

from asset2sim.assets.formats.source import open_source
from asset2sim.assets.urdf.reach import Reach
from asset2sim.assets.views import render_views
from asset2sim.assets.views.surface import Surface
from schemas.settings import ViewSettings


@dataclass(frozen=True)
class Before:
    """The picture of an asset as it came: of the folder ``raw``, of what is within ``reach``, into the file ``to``, as
    a WebP of this quality (0 to 100)."""

    raw: Path
    reach: Reach
    to: Path
    quality: int


def draw_before(before: Before, loaded: dict[Path, tuple[Surface, ...]] | None = None) -> None:
    """Draw an asset's own files, every joint at zero, from the view that its refined picture has. ``loaded`` remembers
    mesh files already read. Raises AssetError."""
    source = open_source(before.raw, reach=before.reach)
    picture = render_views(source.urdf, {}, ViewSettings(), ("perspective",), loaded)["perspective"]
    picture.save(before.to, quality=before.quality)
