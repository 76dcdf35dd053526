"""Data types of a planted defect: where it is planted, what it changes, and when it counts as mended."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from schemas.asset import AssetRecord


@dataclass(frozen=True)
class Target:
    """Where a defect is planted: an asset of the samples, a link of it, and the joint that moves it."""

    asset_id: str
    link: str = ""
    joint: str = ""


@dataclass(frozen=True)
class Planted:
    """What was changed, in words, and the links and joints that it concerns."""

    what: str
    links: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()


@dataclass(frozen=True)
class RefinedAsset:
    """A refined asset: its folder and its record."""

    folder: Path
    record: AssetRecord


Plant = Callable[[Path, Target], Planted]
"""Plants a defect in a copy of a clean asset's folder."""
Left = Callable[[RefinedAsset, RefinedAsset, Target], str]
"""Why a defect is left, or an empty text: from the clean asset, the refined planted asset and the target."""


@dataclass(frozen=True)
class Defect:
    """One class of defect seen in real assets, planted in one place."""

    name: str
    target: Target
    plant: Plant
    left: Left
