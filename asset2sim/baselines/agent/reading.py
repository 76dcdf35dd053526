"""Plain-text rows for an agent: summary, links, joints and files of an asset. Names are quoted: they are data."""

import json

from asset2sim.assets.extract import Extraction
from asset2sim.baselines.agent.specs import MAX_RESULT_CHARS
from schemas.features import JointFeatures, LinkFeatures

ROOM = 500
"""Characters reserved for the line that says from which row to read on."""


def read_part(extraction: Extraction, part: str, start: int) -> str:
    """Text of one part of an asset from row ``start``, as many rows as fit; the last line says where to read on."""
    rows = {"summary": _summary, "links": _links, "joints": _joints, "files": _files}[part](extraction)
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


def _summary(extraction: Extraction) -> list[str]:
    features = extraction.features
    return [
        f"asset {json.dumps(features.asset_id)}, category {json.dumps(features.category)}, file {features.urdf_file}",
        f"root link {json.dumps(features.root)}; {len(features.links)} links, {len(features.joints)} joints, "
        f"{len(features.movable_joints)} of them movable",
        f"size at rest {_lengths(features.rest_size)}; with every joint closed {_lengths(features.closed_size)}",
        f"links without inertial: {sum(link.inertial is None for link in features.links)}",
    ]


def _links(extraction: Extraction) -> list[str]:
    return [_link(link) for link in extraction.features.links]


def _link(link: LinkFeatures) -> str:
    inertial = "no inertial" if link.inertial is None else f"mass {link.inertial.mass_kg:.4g} kg"
    if not link.has_geometry:
        return f"link {json.dumps(link.name)} ({json.dumps(link.label)}): no geometry; {inertial}"
    materials = f"; materials {json.dumps(link.materials)}" if link.materials else ""
    return (
        f"link {json.dumps(link.name)} ({json.dumps(link.label)}): box {_lengths(link.box_size)}, volume "
        f"{link.volume_m3:.4g} m³ ({link.volume_source}), hull {link.hull_volume_m3:.4g} m³, {len(link.meshes)} "
        f"meshes; {inertial}{materials}"
    )


def _joints(extraction: Extraction) -> list[str]:
    return [_joint(joint) for joint in extraction.features.joints]


def _joint(joint: JointFeatures) -> str:
    head = f"joint {json.dumps(joint.name)}: {joint.type}, {json.dumps(joint.parent)} to {json.dumps(joint.child)}"
    if not joint.movable:
        return head
    limits = "no limits" if joint.lower is None or joint.upper is None else f"{joint.lower:.4g} to {joint.upper:.4g}"
    return (
        f"{head}, {limits} {'m' if joint.prismatic else 'rad'}; axis in the root's frame "
        f"{_vector(joint.axis_in_root)}; damping {_stated(joint.damping)}, friction {_stated(joint.friction)}"
    )


def _files(extraction: Extraction) -> list[str]:
    rows = [f"{extraction.features.urdf_file}: {extraction.urdf.stat().st_size} bytes"]
    for reference, file in sorted(extraction.mesh_files.items()):
        rows.append(f"{json.dumps(reference)}: {'missing' if file is None else f'{file.stat().st_size} bytes'}")
    return rows


def _lengths(values: tuple[float, float, float]) -> str:
    return " × ".join(f"{value:.4g}" for value in values) + " m"


def _vector(values: tuple[float, float, float]) -> str:
    return "(" + ", ".join(f"{value:.3g}" for value in values) + ")"


def _stated(value: float | None) -> str:
    return "not stated" if value is None else f"{value:.4g}"
