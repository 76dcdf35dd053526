"""Collision geometry of a whole asset by mode: as authored, one hull a shell, or pieces that leave hollows empty."""

import hashlib
from collections.abc import Collection, Mapping
from functools import partial
from pathlib import Path

import numpy as np
import scipy

from asset2sim.assets.extract import Extraction
from asset2sim.assets.hulls import Hulls, collision_hulls, primitive_hulls, simplified
from asset2sim.assets.meshes.array_file import read_clouds, write_clouds
from asset2sim.assets.meshes.hollow import samples
from asset2sim.assets.meshes.load import scale_vector
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import apply, link_to_root, tree_of
from asset2sim.refinement.collision.link_pieces import (
    LinkPieces,
    Sizes,
    link_pieces,
    link_shells,
    on_floors,
    with_at_most,
)
from asset2sim.refinement.collision.wheels import with_round_wheels
from schemas.finding import Finding
from schemas.settings import CollisionSettings
from schemas.vocabulary import CollisionMode, Severity, Stage

FORMAT = "4"
"""Part of every cache key: raise it when the same input gives other pieces."""


def content_key(extraction: Extraction, scale: float, settings: CollisionSettings) -> str:
    """Hash of all inputs of the pieces: asset files, scale, settings and SciPy's version."""
    digest = hashlib.sha256()
    for part in (FORMAT, scipy.__version__, extraction.features.content_hash, repr(scale), settings.model_dump_json()):
        digest.update(part.encode() + b"\0")
    return digest.hexdigest()[:40]


def read_shapes(path: Path) -> tuple[Hulls, tuple[Finding, ...]] | None:
    """Cached hulls and findings; None where the file is missing or damaged."""
    stored = read_clouds(path)
    if stored is None:
        return None
    clouds, said = stored
    hulls: Hulls = {}
    try:
        for link, count in said["links"]:
            hulls[link], clouds = tuple(clouds[:count]), clouds[count:]
        return hulls, tuple(Finding.model_validate(finding) for finding in said["findings"])
    except (ValueError, KeyError, TypeError):
        return None


def write_shapes(path: Path, hulls: Hulls, findings: tuple[Finding, ...]) -> None:
    """Write hulls and findings to the cache; see ``write_clouds``."""
    said = {
        "links": [[link, len(pieces)] for link, pieces in hulls.items()],
        "findings": [finding.model_dump(mode="json") for finding in findings],
    }
    write_clouds(path, [piece for pieces in hulls.values() for piece in pieces], said)


SHEET_SHARE = 0.004
"""Thickest that a sheet may become over the object's longest extent: 2 mm on 50 cm, less on what is smaller."""


def collision_shapes(
    extraction: Extraction, scale: float, settings: CollisionSettings, cache: Path | None = None
) -> tuple[Hulls, tuple[Finding, ...]]:
    """Convex pieces of each link, (k, 3) points in its frame at the final scale, and findings for what was changed.

    Mode ``keep`` returns no hulls: the authored collision geometry stays. The same content, scale and settings always
    give the same pieces; ``cache`` is a folder that stores them, safe for concurrent processes.
    """
    if settings.mode is CollisionMode.KEEP:
        return {}, ()
    made, told = pieces_of(extraction, scale, settings, cache)
    hulls, rounded = with_round_wheels(made, extraction.features, extraction.geometry)
    if settings.cut_primitives:
        hulls = hulls | {link: (*hulls.get(link, ()), *own) for link, own in primitive_hulls(extraction, scale).items()}
    return hulls, (*told, *rounded)


def pieces_of(
    extraction: Extraction, scale: float, settings: CollisionSettings, cache: Path | None
) -> tuple[Hulls, tuple[Finding, ...]]:
    """The pieces of each link as it is drawn, and findings for what was changed."""
    if settings.mode is CollisionMode.REPAIR:
        return collision_hulls(extraction, scale), sheet_findings(extraction)
    path = None if cache is None else cache / f"{content_key(extraction, scale, settings)}.npz"
    if path is not None and (known := read_shapes(path)) is not None:
        return known
    hulls, findings = decomposed(extraction, scale, settings)
    if path is not None:
        write_shapes(path, hulls, findings)
    return hulls, findings


def decomposed(extraction: Extraction, scale: float, settings: CollisionSettings) -> tuple[Hulls, tuple[Finding, ...]]:
    """Pieces of each link within the link's and the asset's budget, and findings for links changed by it."""
    extent = max(extraction.features.rest_size)
    sizes = Sizes(
        ball_radius=min(settings.hollow_share / 2.0 * extent, settings.hollow_m / 2.0 / scale),
        thickness=min(SHEET_SHARE * extent, settings.sheet_thickness_m / scale),
    )
    shells = {link: link_shells(extraction, link) for link in extraction.geometry}
    triangles = {link: np.vstack([shell.triangles for shell in own]) for link, own in shells.items() if own}
    occupied = {link: samples(corners, sizes.ball_radius) for link, corners in triangles.items()}
    poses = link_poses_of_states(extraction)
    found = {
        link: link_pieces(own, partial(standing_near, link, occupied, poses), sizes, settings.max_link_hulls)
        for link, own in shells.items()
    }
    most = piece_limit([len(item.pieces) for item in found.values()], settings.max_asset_hulls)
    found = {link: with_at_most(item, sizes, most) for link, item in found.items()}
    looks = visual_triangles(extraction, [link for link, item in found.items() if len(item.pieces) > 1])
    found = {link: on_floors(item, looks.get(link), poses[0][link][2, :3], sizes) for link, item in found.items()}
    hulls = {link: tuple(simplified(piece.points) * scale for piece in item.pieces) for link, item in found.items()}
    return hulls, tuple(note for link, item in found.items() for note in findings_of(link, item, scale))


def visual_triangles(extraction: Extraction, links: Collection[str]) -> dict[str, Array]:
    """Link → (k, 3, 3) triangles of its visual meshes in its frame, of these links; none for one without."""
    found: dict[str, Array] = {}
    for link in links:
        drawn = [np.zeros((0, 3, 3))]
        for item in extraction.links[link].visuals:
            mesh = item.geometry.mesh
            file = None if mesh is None else extraction.mesh_files.get(mesh.filename)
            if mesh is not None and file is not None:
                read = extraction.triangles.mesh(file, scale_vector(mesh))
                placed = np.eye(4) if item.origin is None else np.asarray(item.origin, dtype=float)
                drawn.append(apply(placed, np.asarray(read.vertices, dtype=float))[np.asarray(read.faces)])
        if len(drawn) > 1:
            found[link] = np.vstack(drawn)
    return found


def link_poses_of_states(extraction: Extraction) -> list[dict[str, Array]]:
    """Link → (4, 4) link-to-root transforms at rest, and with all joints closed, half open and open."""
    joints = extraction.features.movable_joints
    tree = tree_of(extraction.features.joints)
    ends = [(j.name, j.closed, j.open) for j in joints if j.closed is not None and j.open is not None]
    positions: list[dict[str, float]] = [{}]
    positions += [{name: closed + share * (opened - closed) for name, closed, opened in ends} for share in (0, 0.5, 1)]
    return [link_to_root(tree, extraction.features.root, state) for state in positions]


def standing_near(link: str, occupied: Mapping[str, Array], poses: list[dict[str, Array]]) -> Array:
    """(n, 3) points of all other links in one link's frame, in each state, within the link's box."""
    low, high = occupied[link].min(axis=0), occupied[link].max(axis=0)
    near, known = [np.zeros((0, 3))], set[tuple[str, bytes]]()
    for state in poses:
        to_link = np.linalg.inv(state[link])
        for other, points in occupied.items():
            place = to_link @ state[other]
            as_before = (other, np.round(place, 12).tobytes())
            if other != link and as_before not in known:
                placed = apply(place, points)
                near.append(placed[np.all((placed >= low) & (placed <= high), axis=1)])
            known.add(as_before)
    return np.vstack(near)


def piece_limit(counts: list[int], most: int) -> int:
    """Largest limit per link for which the total number of pieces is at most ``most``; at least 1."""
    limit = max(counts, default=1)
    while limit > 1 and sum(min(count, limit) for count in counts) > most:
        limit -= 1
    return max(limit, 1)


def findings_of(link: str, item: LinkPieces, scale: float) -> list[Finding]:
    """Findings for changes to one link's collision shapes."""
    litres = 1000.0 * scale**3
    filled = litres * item.filled
    notes: list[Finding] = []
    if item.decals:
        notes.append(sheets_left_out(link, item.decals))
    if item.walls:
        text = f"link '{link}': {item.walls} sheets without a thickness collide as thin walls"
        notes.append(info(code="sheet_thickened", link=link, message=text))
    if item.cut_shells:
        text = (
            f"link '{link}': {item.cut_shells} hollow shells collide as {len(item.pieces)} convex pieces with the "
            f"rest; their hulls filled {litres * item.filled_before:.3g} l of what is open, the pieces {filled:.3g} l"
        )
        notes.append(info(code="collision_decomposed", link=link, message=text, value=filled))
    if item.filled > item.allowed + STILL_SHARE * item.filled_before:
        text = (
            f"link '{link}': {filled:.3g} l of its hollow stay filled, since more convex pieces than the budget allows "
            "would be needed; raise collision.max_link_hulls or collision.max_asset_hulls"
        )
        allowed = litres * item.allowed
        notes.append(warning(code="collision_fallback", link=link, message=text, value=filled, limit=allowed))
    return notes


info = partial(Finding, stage=Stage.APPLY, severity=Severity.INFO)
warning = partial(Finding, stage=Stage.APPLY, severity=Severity.WARNING)
"""Findings of the stage that writes the shapes, by how much they matter."""
STILL_SHARE = 0.1
"""Share of the hollow volume filled by hulls that may stay filled before it is reported as a fallback."""


def sheet_findings(extraction: Extraction) -> tuple[Finding, ...]:
    """Findings for sheets in mode ``repair``: beside solids they do not collide, alone they are thickened."""
    notes: list[Finding] = []
    for link, geometry in extraction.geometry.items():
        sheets = sum(1 for part in geometry.parts if part.sheet is not None)
        if sheets and sheets < len(geometry.parts):
            notes.append(sheets_left_out(link, sheets))
        elif sheets:
            text = f"link '{link}': its {sheets} sheets without a thickness collide as thin walls"
            notes.append(info(code="sheet_thickened", link=link, message=text))
    return tuple(notes)


def sheets_left_out(link: str, count: int) -> Finding:
    """Finding for sheets that stay visual only."""
    text = f"link '{link}': {count} flat meshes on its solids are looks and do not collide"
    return info(code="sheet_dropped", link=link, message=text)
