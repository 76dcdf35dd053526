"""Drawing an asset as it came; for a child process, since it imports an engine and reads files that may crash it."""

from pathlib import Path

from asset2sim.assets.formats.source import open_source
from asset2sim.assets.urdf.reach import Reach
from asset2sim.assets.views import render_views
from schemas.settings import ViewSettings


def draw_before(raw: Path, reach: Reach, to: Path, quality: int) -> None:
    """Draw an asset's own files, every joint at zero, from the view that its refined picture has, as a WebP of this
    quality (0 to 100). Raises AssetError."""
    source = open_source(raw, reach=reach)
    picture = render_views(source.urdf, {}, ViewSettings(), ("perspective",))["perspective"]
    picture.save(to, quality=quality)
