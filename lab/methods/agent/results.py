"""Results of the agent's tools, of bounded length: JSON with few digits, what an asset is in rows of it.
Names are quoted: they are data."""

import json
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from asset2sim.assets.extract import Extraction
from asset2sim.checks.at_rest import measurement_verdict
from asset2sim.models.object_facts import rounded_floats
from asset2sim.physics.arrays import Array
from lab.methods.agent.specs import MAX_QUOTED_CHARS, MAX_RESULT_CHARS, MAX_ROWS
from schemas.errors import shortened
from schemas.interaction import ContactPair, Measurement
from schemas.overlay import PhysicsOverlay
from schemas.settings import Thresholds

DIGITS = 4
"""Significant digits of a number in a result."""
LIMITS = (
    "penetration_m", "drift_m", "drift_rad", "peak_speed_m_s", "oscillation_sign_changes", "oscillation_rad",
    "oscillation_m",
)  # fmt: skip
"""Thresholds stated in a result: those of the paper's checks."""
STILL = 1e-3
"""Motion below which a joint counts as still in a result, rad or m."""


def simulated(measurement: Measurement, physics: PhysicsOverlay, thresholds: Thresholds) -> str:
    """Result of ``simulate``: the paper's three checks, and the joints that moved with their dynamics."""
    prismatic = frozenset(joint.name for joint in physics.all_joints if joint.type == "prismatic")
    verdict = measurement_verdict(measurement, prismatic, thresholds)
    joints = {joint.name: joint for joint in physics.all_joints}
    settling = measurement.settle_motion
    motions = [motion for motion in measurement.joints if motion.name in joints]
    moved = [(max(motion.amplitude, settling.get(motion.name, 0.0)), motion) for motion in motions]
    moving = sorted((item for item in moved if item[0] > STILL), key=lambda item: -item[0])
    return text_of({
        "passed": verdict.passed,
        "failed": verdict.mode.value,
        "reason": verdict.reason,
        "penetration_m": measurement.penetration_m,
        "pairs": pair_rows(measurement.pairs)[:MAX_ROWS],
        "drift_m": measurement.drift_m,
        "drift_rad": measurement.drift_rad,
        "peak_speed_m_s": measurement.peak_speed_m_s,
        "moving_joints": [
            {
                "joint": motion.name,
                "amplitude": motion.amplitude,
                "sign_changes": motion.sign_changes,
                "moved_while_settling": settling.get(motion.name, 0.0),
                "damping": joints[motion.name].damping,
                "friction": joints[motion.name].friction,
            }
            for _, motion in moving[:MAX_ROWS]
        ],
        "n_moving_joints": len(moving),
        "console": list(measurement.console[:MAX_ROWS]),
        "limits": thresholds.model_dump(include=set(LIMITS)),
    })  # fmt: skip


def touching(pairs: Sequence[ContactPair]) -> str:
    """Result of ``read_contacts``: overlapping pairs with their depths, worst first."""
    total = sum(pair.penetration_m for pair in pairs)
    return text_of({"penetration_m": total, "n_pairs": len(pairs), "pairs": pair_rows(pairs)[:MAX_ROWS]})


def pair_rows(pairs: Sequence[ContactPair]) -> list[dict[str, object]]:
    """One row per pair: its links, its deepest point (m) and its contribution to Φ (m)."""
    return [pair.model_dump(include={"link_a", "link_b", "depth_m", "penetration_m"}) for pair in pairs]


def boxes_text(boxes: Mapping[str, tuple[Array, Array]], images: str) -> str:
    """Result of ``render``: every link's box, m in the root link's frame; ``images`` says if pictures follow."""
    rows = [{"link": name, "low_m": low.tolist(), "high_m": high.tolist()} for name, (low, high) in boxes.items()]
    corners = [corner for box in boxes.values() for corner in box]
    size = np.ptp(corners, axis=0).tolist() if corners else []
    return text_of({"images": images, "size_m": size, "n_links": len(rows), "boxes": rows[:MAX_ROWS]})


def refused(message: str) -> str:
    """A tool's refusal, as its result."""
    return text_of({"error": message})


def text_of(value: object) -> str:
    """A value as compact JSON with few digits."""
    return json.dumps(rounded_floats(value, DIGITS), ensure_ascii=False, separators=(",", ":"), allow_nan=False)


def cut(text: str, most: int = MAX_RESULT_CHARS) -> str:
    """The text, shortened to ``most`` characters and its length, without characters that UTF-8 cannot encode."""
    text = text.encode("utf-8", "replace").decode("utf-8")
    return text if len(text) <= most else f"{text[:most]}… ({len(text)} characters in all)"


short = partial(shortened, length=MAX_QUOTED_CHARS)
"""A wrong value as an error quotes it."""
ROOM = 500
"""Characters reserved for the line that says from which row to read on."""


def read_part(extraction: Extraction, part: str, start: int) -> str:
    """Text of one part of an asset from row ``start``, as many rows as fit; the last line says where to read on."""
    features = extraction.features
    parts = {
        "summary": [features.model_dump(exclude={"links", "joints"})], "files": _files(extraction),
        "links": [link.model_dump(exclude={"meshes"}) for link in features.links],
        "joints": [joint.model_dump() for joint in features.joints],
    }  # fmt: skip
    rows = [text_of(row) for row in parts[part]]
    shown: list[str] = []
    length = 0
    for row in rows[start:]:
        length += len(row) + 1
        if shown and length > MAX_RESULT_CHARS - ROOM:
            break
        shown.append(row)
    end = start + len(shown)
    if end < len(rows):
        shown.append(f"({len(rows) - end} more rows: read on with start {end})")
    return "\n".join(shown) or f"(no rows from {start} on; there are {len(rows)})"


def _files(extraction: Extraction) -> list[dict[str, object]]:
    """The URDF and every mesh file that it names, with their bytes; null where one is missing."""
    named = {extraction.features.urdf_file: extraction.urdf, **dict(sorted(extraction.mesh_files.items()))}
    return [{"file": name, "bytes": None if file is None else file.stat().st_size} for name, file in named.items()]
