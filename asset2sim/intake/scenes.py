"""The assets of a dataset in which scenes stand: each part of a scene is an asset, fixed where it stands or free."""

from collections.abc import Sequence

from asset2sim.intake.asset_folders import safe_id
from asset2sim.intake.origin import parts_in
from asset2sim.intake.split import Part
from schemas.asset import AssetRef
from schemas.inputs import InputSettings
from schemas.support import SupportKind
from schemas.vocabulary import UpAxis


def with_parts(refs: Sequence[AssetRef], inputs: InputSettings) -> list[AssetRef]:
    """The assets, in the place of each scene its parts, called after both. What is said of a scene is not said of its
    parts: they have rows of their own in ``overrides.csv``. A file that cannot be read is an asset that says so."""
    return [part for ref in refs for part in _split(ref, inputs)]


def _split(ref: AssetRef, inputs: InputSettings) -> list[AssetRef]:
    if ref.fault is not None:
        return [ref]
    try:
        return [asset_of(ref, part) for part in parts_in(ref, ref.up or UpAxis.Z, inputs)] or [ref]
    except Exception:  # any: one file that cannot be cut ends no run, and reading it in its own process says why
        return [ref]


def asset_of(scene: AssetRef, part: Part) -> AssetRef:
    """The asset that a part of a scene is."""
    return AssetRef(
        asset_id=f"{scene.asset_id}.{safe_id(part.name)}",
        path=scene.path,
        subset=scene.subset,
        support=SupportKind.FREESTANDING if part.free else SupportKind.FIXED,
        up=scene.up,
        root=scene.root,
        keep=scene.keep,
        scene=scene.asset_id,
        part=part.name,
    )
