"""Drawing an asset as it came; for a child process, since it imports an engine and reads files that may crash it."""

from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from asset2sim.assets.surfaces.surface import Surface
from asset2sim.assets.urdf.references import AllowedFolders
from asset2sim.intake.origin import open_origin
from asset2sim.render import render_views
from schemas.settings import ViewSettings


@dataclass(frozen=True)
class Before:
    """The picture of an asset as it came: of the folder ``raw``, of what is within ``reach``, into the file ``to``, as
    a WebP of this quality (0 to 100) and effort (0 to 6)."""

    raw: Path
    reach: AllowedFolders
    to: Path
    quality: int
    method: int = 2


def draw_before(
    before: Before,
    loaded: dict[Path, tuple[Surface, ...]] | None = None,
    urdf: Path | None = None,
    view: Path | None = None,
) -> None:
    """Draw an asset's own files, every joint at zero, from the view that its refined picture has. ``loaded`` remembers
    mesh files already read; ``urdf`` is the asset's own as it is read, if that is known, all of whose files are within
    reach; ``view`` a picture that shows the same, which is taken where it is as large. Raises AssetError."""
    settings = ViewSettings()
    if view is not None and view.is_file():
        with Image.open(view) as image:
            if image.size == (settings.width, settings.height):
                image.convert("RGB").save(before.to, quality=before.quality, method=before.method)
                return
    if urdf is None:
        source = open_origin(before.raw, reach=before.reach)  # what is made of it is there as long as this is
        urdf = source.urdf
    picture = render_views(urdf, {}, settings, ("perspective",), loaded)["perspective"]
    picture.save(before.to, quality=before.quality, method=before.method)
