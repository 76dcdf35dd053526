"""Distance from an expert reference: scale and the joint of interest (paper, evaluation, section 2)."""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from schemas.asset import AssetRecord

FILE = "reference.csv"
NOT_ARTICULATING = ("_move", "_lift")
"""Endings of tasks that carry the whole object: where there is another task, that one states the joint of interest."""
UNSTATED_SCALE = 1.0
"""The scale that the reference's loader assumes where the expert states none."""


@dataclass(frozen=True)
class Reference:
    """What an expert chose for one object: scale, and the position of the joint of interest (rad or m at scale 1)."""

    scale: float
    joint: str
    position: float


@dataclass(frozen=True)
class Deviation:
    """How far one asset is from its reference: |s − s_ref| / s_ref, and |q − q_ref| in rad (None for sliders)."""

    asset_id: str
    scale: float
    stated: bool
    joint_rad: float | None


def read_references(file: Path) -> dict[str, Reference]:
    """Asset id → its reference; of several tasks the one that articulates the object. Empty where there is no file."""
    if not file.is_file():
        return {}
    with file.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    # Tasks that articulate come last, so that they replace those that carry.
    rows.sort(key=lambda row: not row["gensim2_task"].endswith(NOT_ARTICULATING))
    return {row["asset_id"]: Reference(float(row["scale"]), row["joint"], float(row["joint_position"])) for row in rows}


def deviations(records: Sequence[AssetRecord], references: Mapping[str, Reference]) -> tuple[Deviation, ...]:
    """The deviation of every record that has an overlay and a reference. Angles are compared modulo a turn."""
    found = []
    for record in records:
        reference = references.get(record.ref.asset_id)
        if reference is None or record.overlay is None:
            continue
        joint = next((joint for joint in record.overlay.joints if joint.name == reference.joint), None)
        turned = None
        if joint is not None and joint.type != "prismatic":
            turned = abs(math.remainder(joint.initial_position - reference.position, 2.0 * math.pi))
        scale = abs(record.overlay.scale - reference.scale) / reference.scale
        found.append(Deviation(record.ref.asset_id, scale, reference.scale != UNSTATED_SCALE, turned))
    return tuple(found)


def deviation_line(found: Sequence[Deviation]) -> str:
    """One line on all deviations: the mean scale deviation with and without unstated references, and the joint's."""
    stated = [item.scale for item in found if item.stated]
    line = f"off the expert reference: scale {100 * mean(stated):.1f} % over {len(stated)} assets"
    if len(stated) < len(found):
        everyone = 100 * mean([item.scale for item in found])
        line += f" ({everyone:.1f} % over {len(found)}, those whose reference states no scale included)"
    turned = [item.joint_rad for item in found if item.joint_rad is not None]
    return f"{line}; first joint position {mean(turned):.2f} rad over {len(turned)} hinges" if turned else line


def mean(values: Sequence[float]) -> float:
    """The mean, or not-a-number of nothing."""
    return sum(values) / len(values) if values else math.nan
