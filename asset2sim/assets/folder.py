"""Apply: asset + overlay → a refined, self-contained folder. Edits only what the overlay names, never the input."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from asset2sim.assets.extract import Extraction
from asset2sim.assets.hulls import CollisionFiles, Hulls, write_hulls
from asset2sim.assets.urdf.edit import refined_urdf
from asset2sim.assets.urdf.mesh_files import PICTURES, copy_meshes
from schemas.overlay import PhysicsOverlay
from schemas.recipe import CutHull
from schemas.settings import PhysicsSettings
from schemas.vocabulary import CollisionMode

URDF_NAME = "mobility.urdf"
INDEX_NAME, LOADER_NAME = "index.json", "load.py"
"""Files beside the refined folders: what is there to load, and a loader."""


@dataclass(frozen=True)
class Folder:
    """A refined folder being written: mesh reference → its path in it, each link's hull files (none where authored
    collision geometry is kept), and the collision mode."""

    path: Path
    mesh_places: dict[str, str]
    collision: CollisionFiles
    mode: CollisionMode = CollisionMode.REPAIR
    cuts: dict[str, tuple[CutHull, ...]] = field(default_factory=dict)
    """Link whose hulls were cut → how each was made."""
    boxed: tuple[str, ...] = ()
    """Hulls' files that hold their boxes in their place."""
    cut_primitives: bool = False
    """Whether the hulls stand for the boxes and cylinders of the file, too."""

    @property
    def urdf(self) -> Path:
        """The folder's URDF."""
        return self.path / URDF_NAME


def write_folder(
    extraction: Extraction,
    overlay: PhysicsOverlay,
    hulls: Hulls,
    target: Path,
    settings: PhysicsSettings,
    mode: CollisionMode = CollisionMode.REPAIR,
    *,
    cut_primitives: bool = False,
) -> Folder:
    """Write meshes, companions, collision hulls and the URDF. Where ``mode`` is ``keep``, collision meshes are brought
    as authored and ``hulls`` are not written. With ``cut_primitives`` boxes and cylinders are among the hulls."""
    target.mkdir(parents=True, exist_ok=True)
    roles = ("visual", "collision") if mode is CollisionMode.KEEP else ("visual",)
    looks = {mesh.file for link in extraction.features.links for mesh in link.meshes if mesh.role in roles}
    files = extraction.mesh_files.items()
    wanted = {name: file for name, file in files if name in looks or Path(name).suffix.lower() in PICTURES}
    places = copy_meshes(wanted, extraction.source.parent, target)
    for name, file in extraction.companions.items():
        shutil.copyfile(file, target / name)
    folder = replace_hulls(Folder(target, places, {}, mode, cut_primitives=cut_primitives), hulls)
    write_urdf(extraction, overlay, folder, settings)
    return folder


def replace_hulls(folder: Folder, hulls: Hulls) -> Folder:
    """Write other hulls; the folder with them, whose URDF must be written again. In mode ``keep`` nothing changes."""
    if folder.mode is CollisionMode.KEEP:
        return folder
    return replace(folder, collision=write_hulls(hulls, folder.path))


def write_urdf(extraction: Extraction, overlay: PhysicsOverlay, folder: Folder, settings: PhysicsSettings) -> None:
    """Write the folder's URDF."""
    document = refined_urdf(
        extraction.urdf,
        extraction.features,
        overlay,
        folder.mesh_places,
        folder.collision,
        settings,
        folder.mode,
        cut_primitives=folder.cut_primitives,
    )
    folder.urdf.write_bytes(document)


@contextmanager
def staged_folder(final: Path) -> Iterator[Path]:
    """An empty folder beside ``final`` that replaces it when the block succeeds, and is deleted when it raises."""
    final.parent.mkdir(parents=True, exist_ok=True)
    staged = final.parent / f".{final.name}.new"
    retired = final.parent / f".{final.name}.old"
    # Leftovers of a killed run: at most one per asset, and one process at a time works on an asset.
    shutil.rmtree(staged, ignore_errors=True)
    if retired.is_dir() and not final.exists():
        os.replace(retired, final)
    shutil.rmtree(retired, ignore_errors=True)
    staged.mkdir()
    try:
        yield staged
    except BaseException:
        shutil.rmtree(staged, ignore_errors=True)
        raise
    if final.exists():
        os.replace(final, retired)
    os.replace(staged, final)
    shutil.rmtree(retired, ignore_errors=True)
