"""Convex pieces of a concave mesh, so that what is hollow stays hollow in a simulator.

Two methods, each where it is the better one. CoACD cuts a closed surface exactly, but dies on an open one, and its own
repair of open surfaces fattens thin walls and takes minutes. Dataset meshes are mostly double-sided: with one side left
out many are closed after all, and an open one becomes closed as a thin wall. V-HACD works on voxels: it takes any soup
in seconds, half a voxel too thick. Each attempt runs in a process of its own, because either can hang or crash.
"""

import os
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import trimesh
from pydantic import Field
from scipy.spatial import ConvexHull, QhullError

from asset2sim.assets.meshes.array_file import read_clouds
from asset2sim.assets.meshes.decompose_pieces import clip, merge
from asset2sim.assets.meshes.hull import hull_of, hull_volume
from asset2sim.assets.meshes.volume import EXACT_SHARE
from asset2sim.physics.arrays import Array, Faces
from schemas.base import Fraction, Frozen, Positive

HOLE_SHARE = 0.05
"""Area over the whole mesh's up to which a hole of three or four edges is a missing face, not an opening."""


@dataclass(frozen=True)
class ClosedSurface:
    """A closed (n, 3), (m, 3) triangle surface, the volume it encloses, and whether the mesh was closed as authored."""

    vertices: Array
    faces: Faces
    volume: float
    authored: bool


def surface_of(vertices: Array, faces: Faces, wall_thickness: float) -> ClosedSurface | None:
    """The closed surface of a mesh; ``wall_thickness`` is that of open sheets over the mesh's longest extent. None
    where faces meet three or more to an edge, or cannot be wound alike: no surface has an inside there."""
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    single = trimesh.Trimesh(vertices, faces[np.sort(first)], process=False)
    single.update_faces(single.nondegenerate_faces())
    single.remove_unreferenced_vertices()
    if len(single.faces) < 4:
        return None
    trimesh.repair.fix_winding(single)
    if not single.is_watertight:
        filled = single.copy()
        trimesh.repair.fill_holes(filled)
        if filled.is_watertight and filled.area - single.area <= HOLE_SHARE * single.area:
            single = filled
    authored = bool(single.is_watertight)
    extent = float(np.ptp(single.vertices, axis=0).max())
    closed = single if authored else closed_wall(single, wall_thickness * extent)
    if not (closed.is_watertight and closed.is_winding_consistent):
        return None
    trimesh.repair.fix_normals(closed)
    return ClosedSurface(np.asarray(closed.vertices), np.asarray(closed.faces), abs(float(closed.volume)), authored)


def closed_wall(sheet: trimesh.Trimesh, thickness: float) -> trimesh.Trimesh:
    """An open sheet as a closed wall: a side at half of ``thickness`` each way, joined along the sheet's border."""
    normals = np.asarray(sheet.vertex_normals) * (thickness / 2.0)
    edges = np.asarray(sheet.edges)
    _, index, count = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    border = edges[count[index.ravel()] == 1]
    other = border + len(normals)
    first = np.column_stack([border[:, 1], border[:, 0], other[:, 0]])
    second = np.column_stack([border[:, 1], other[:, 0], other[:, 1]])
    faces = np.vstack([sheet.faces, sheet.faces[:, ::-1] + len(normals), first, second])
    return trimesh.Trimesh(np.vstack([sheet.vertices + normals, sheet.vertices - normals]), faces, process=False)


Pieces = tuple[Array, ...]


class DecomposeSettings(Frozen):
    """How finely a mesh is cut into convex pieces, and for how long it may be tried."""

    threshold: float = Field(0.05, ge=0.01, le=1.0)
    """CoACD's concavity, of half the longest extent, up to which a piece counts as convex: 1 cm on a 40 cm drawer."""
    max_hulls: int = Field(16, ge=1, le=64)
    """Most pieces of one mesh: every engine pays for each of them at every step."""
    max_hull_vertices: int = Field(32, ge=8, le=256)
    """Most vertices of one V-HACD piece: contact slows with vertices; 32 is a choice, not measured."""
    sample_resolution: int = Field(500, ge=100, le=10_000)
    """Surface samples that CoACD measures concavity with: 500 and 1000 gave piece counts within 2 of each other."""
    mcts_nodes: int = Field(10, ge=4, le=40)
    """Candidate planes along each axis in CoACD's search ..."""
    mcts_iterations: int = Field(30, ge=5, le=2000)
    """... how often a plane is tried ..."""
    mcts_max_depth: int = Field(2, ge=1, le=7)
    """... and how many cuts it looks ahead: with 20, 60 and 3, half of the open test meshes passed 12 s."""
    preprocess_resolution: int = Field(100_000, ge=10_000, le=10_000_000)
    """V-HACD's voxels: 20,000 fatten walls by 1.3 % of the diagonal, 100,000 by 0.6 % in eight times the time."""
    wall_thickness: Fraction = 0.004
    """Thickness given to open sheets, over the longest extent: 2 mm on a 50 cm drawer, as thin panels have."""
    convex_share: Fraction = EXACT_SHARE
    """Share of its hull that a closed mesh fills from which it is its hull."""
    flat_share: Fraction = 0.01
    """Thickness over extent below which a mesh is a plate, left alone: no hollow, and CoACD may take hours over it."""
    max_faces: int = Field(1500, ge=100)
    """Faces above which CoACD is not tried: thin walls of 2,500 faces passed 12 s, of 1,300 took 2 to 4 s."""
    max_voxel_faces: int = Field(200_000, ge=1000)
    """Faces above which nothing is tried: V-HACD only has to voxelize them, which is linear."""
    cpu_limit_s: Positive = 20.0
    """Processor time of one method on one mesh, s: the slowest of the test meshes took 8 s, and a busy machine counts
    up to twice as much for the same work."""
    wall_limit_s: Positive = 600.0
    """Longest wait for one method on one mesh, s: only for a process that waits for ever."""
    seed: int = Field(1, ge=0)
    """Seed of CoACD's search."""


def decompose(vertices: Array, faces: Faces, settings: DecomposeSettings) -> Pieces | None:
    """Convex pieces of a mesh: the (k, 3) hull vertices of each, in the mesh's frame and unit, within the mesh's hull.

    ``vertices`` is (n, 3) float, ``faces`` (m, 3) int and need not be closed or consistently wound. None where the
    mesh is flat, a limit passes, or nothing usable comes back: the caller falls back on the hull. A mesh that is
    convex already comes back as one piece.
    """
    vertices = np.ascontiguousarray(vertices, dtype=np.float64)
    faces = np.ascontiguousarray(faces, dtype=np.int64)
    hull = _thick_hull(vertices, faces, settings)
    return None if hull is None else _decompose(vertices, faces, hull, settings)


def _thick_hull(vertices: Array, faces: Faces, settings: DecomposeSettings) -> ConvexHull | None:
    """The mesh's hull, or None where decomposing is hopeless: broken, flat, or far too large."""
    if not 4 <= len(faces) <= settings.max_voxel_faces or not np.isfinite(vertices).all():
        return None
    used = vertices[np.unique(faces)]
    if hull_of(used) is None:
        return None
    _, _, axes = np.linalg.svd(used - used.mean(axis=0), full_matrices=False)
    extents = np.ptp(used @ axes.T, axis=0)
    if extents.min() <= settings.flat_share * extents.max():
        return None
    try:
        return ConvexHull(used)
    except QhullError:
        return None


def _decompose(vertices: Array, faces: Faces, hull: ConvexHull, settings: DecomposeSettings) -> Pieces | None:
    surface = surface_of(vertices, faces, settings.wall_thickness)
    if surface is not None and surface.authored and surface.volume >= settings.convex_share * hull.volume:
        return (hull.points[hull.vertices],)
    # Clipping needs the closed mesh's own hull; a thickened sheet sticks out of it by half its thickness.
    raw = None
    if surface is not None and len(surface.faces) <= settings.max_faces and find_spec("coacd") is not None:
        raw = _attempt("coacd", surface.vertices, surface.faces, settings)
    pieces = _usable(raw, hull, settings)
    if pieces is None:
        pieces = _usable(_attempt("vhacd", vertices, faces, settings), hull, settings)
    return pieces


def _usable(raw: Pieces | None, hull: ConvexHull, settings: DecomposeSettings) -> Pieces | None:
    """The pieces within the mesh's hull and no more than allowed; None if nothing is left or they outweigh the hull."""
    if not raw:
        return None
    clipped = [piece for piece in (clip(points, hull) for points in raw) if piece is not None]
    pieces = merge(clipped, settings.max_hulls)
    volume = sum(hull_volume(piece) for piece in pieces)
    # Pieces may overlap a little; what is heavier than the hull has filled the hollow that it was to keep.
    return tuple(pieces) if pieces and 0.0 < volume <= 1.02 * hull.volume else None


def _attempt(method: str, vertices: Array, faces: Faces, settings: DecomposeSettings) -> Pieces | None:
    """One method in a process group of its own, killed whole at its limits; None unless it answered."""
    with tempfile.TemporaryDirectory(prefix="decompose-") as folder:
        work, answer = Path(folder) / "mesh.npz", Path(folder) / "pieces.npz"
        np.savez(work, vertices=vertices, faces=faces)
        seconds = max(1, round(settings.cpu_limit_s))
        command = [sys.executable, "-m", "asset2sim.assets.meshes.decompose_worker", method, folder, str(seconds)]
        child = subprocess.Popen(
            [*command, settings.model_dump_json(), str(os.getpid())],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            cwd=Path(__file__).resolve().parents[3],
            # CoACD draws from one random stream per thread: only a single thread repeats itself.
            env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        )
        try:
            child.wait(timeout=settings.wall_limit_s)
        except subprocess.TimeoutExpired:
            return None
        finally:
            _kill(child)
        return _read(answer) if child.returncode == 0 else None


def _kill(child: subprocess.Popen[bytes]) -> None:
    """End the child and whatever it started, and wait for it; an interrupt in the parent comes through here too."""
    if child.poll() is None:
        os.killpg(child.pid, signal.SIGKILL)
        child.wait()


def _read(path: Path) -> Pieces | None:
    stored = read_clouds(path)
    if stored is None:
        return None
    pieces = tuple(stored[0])
    return pieces if pieces and all(np.isfinite(piece).all() for piece in pieces) else None
