"""Triangles of an asset's mesh files: each file is parsed once per process, and cached by content between runs;
and those that a broken export left far away from the rest."""

import hashlib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import trimesh

from asset2sim.assets.meshes.array_file import read_arrays, write_arrays
from asset2sim.assets.meshes.load import load_mesh
from asset2sim.assets.meshes.unusable import UnusableMeshError
from asset2sim.physics.arrays import Array, Faces

Mesh = tuple[Array, Faces]

FORMAT = f"2 trimesh {trimesh.__version__}"
"""Format of the cache file; others are not read. Raise the number when ``load_mesh`` reads a file differently."""
SELF_CONTAINED = (".dae", ".glb", ".obj", ".off", ".ply", ".stl")
"""Formats whose geometry is all in one file; materials and textures do not count."""


def file_key(path: Path) -> str | None:
    """Cache key of a file's triangles: the hash of its content, and its suffix, which selects the parser. None for a
    format whose geometry may lie in other files. Raises OSError where the file cannot be read."""
    if path.suffix.lower() not in SELF_CONTAINED:
        return None
    return f"{hashlib.sha256(path.read_bytes()).hexdigest()} {path.suffix.lower()}"


@dataclass
class Triangles:
    """The triangles of one asset's mesh files, loaded on demand; ``store`` is the cache file."""

    store: Path | None = None
    keys: dict[Path, str | None] = field(default_factory=dict)
    """File → its ``file_key``."""
    meshes: dict[Path, Mesh] = field(default_factory=dict)
    """File → its triangles, those far away from the others among them."""
    used: dict[Path, tuple[Mesh, int]] = field(default_factory=dict)
    """File → its triangles without those, and how many there were."""
    parsed: bool = False
    """Whether a mesh was parsed that the store does not hold."""
    kept: dict[str, Mesh] | None = None
    """The store's meshes by key; None until it is read."""

    def key(self, path: Path) -> str | None:
        """The file's ``file_key``, which is computed once. Raises ValueError where the file cannot be read."""
        if path not in self.keys:
            try:
                self.keys[path] = file_key(path)
            except OSError as error:
                problem = f"cannot be read ({error.strerror}): restore the file"
                raise UnusableMeshError(problem, path.name) from error
        return self.keys[path]

    def of(self, path: Path) -> Mesh:
        """The file's (n, 3) vertices, unscaled, and (k, 3) faces, both read-only, without strays. Raises ValueError as
        ``load_mesh`` does, and where the file cannot be read."""
        if path not in self.meshes:
            key = self.key(path)
            found = self._kept().get(key) if key is not None else None
            if found is None:
                mesh = load_mesh(path)
                found = np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)
                self.parsed = True
            self.meshes[path], self.used[path] = found, without_strays(found)
            for array in (*found, *self.used[path][0]):
                array.flags.writeable = False
        return self.used[path][0]

    def mesh(self, path: Path, scale: Array) -> trimesh.Trimesh:
        """A new mesh of the file at a (3,) scale. Raises ValueError as ``of``."""
        vertices, faces = self.of(path)
        mesh = trimesh.Trimesh(vertices=vertices, faces=faces, process=False)
        mesh.apply_scale(scale)
        return mesh

    def keep(self) -> None:
        """Write the parsed meshes into the store; entries of files that the asset no longer has are dropped."""
        if self.store is None or not self.parsed:
            return
        known = self._kept()
        meshes = {key: known[key] for key in self.keys.values() if key in known}
        for path, mesh in self.meshes.items():
            key = self.keys[path]
            if key is not None:
                meshes[key] = mesh
        write_triangles(self.store, meshes)
        self.parsed = False

    def _kept(self) -> dict[str, Mesh]:
        if self.kept is None:
            self.kept = {} if self.store is None else read_triangles(self.store)
        return self.kept


def read_triangles(path: Path) -> dict[str, Mesh]:
    """The cached meshes by key; empty where the file is missing or damaged."""
    stored = read_arrays(path, ("vertices", "faces", "ends"))
    if stored is None:
        return {}
    arrays, said = stored
    vertices, faces, ends = arrays["vertices"], arrays["faces"].astype(np.int64), arrays["ends"]
    if not isinstance(said, dict) or said.get("format") != FORMAT or ends.shape != (len(said["keys"]), 2):
        return {}
    starts = np.vstack([np.zeros((1, 2), dtype=np.int64), ends])
    return {
        key: (vertices[v0:v1], faces[f0:f1])
        for key, (v0, f0), (v1, f1) in zip(said["keys"], starts, ends, strict=False)
    }


def write_triangles(path: Path, meshes: dict[str, Mesh]) -> None:
    """Replace the cached meshes by these."""
    counts = [[len(vertices), len(faces)] for vertices, faces in meshes.values()]
    arrays = {
        "vertices": np.vstack([np.zeros((0, 3)), *(vertices for vertices, _ in meshes.values())]),
        # int32 halves the file; no mesh has 2^31 vertices.
        "faces": np.vstack([np.zeros((0, 3), np.int32), *(faces.astype(np.int32) for _, faces in meshes.values())]),
        "ends": np.cumsum(np.array(counts, dtype=np.int64).reshape(-1, 2), axis=0),
    }
    write_arrays(path, arrays, {"format": FORMAT, "keys": list(meshes)})


FAR = 100.0
"""Distance of a few triangles from the rest, over its size, from which they are no part of the object: nothing could
hold parts that lie a hundred of their sizes apart."""
LEAST_M = 1e-9
"""Size, m, below which the rest counts for nothing."""


def without_strays(mesh: tuple[Array, Faces]) -> tuple[tuple[Array, Faces], int]:
    """The (n, 3) vertices and (k, 3) faces of a mesh without triangles that are not joined to the rest, fewer than it
    has, and ``FAR`` from it; and how many there were."""
    vertices, faces = mesh
    count, kept = len(faces), faces
    apart = np.abs(vertices - np.median(vertices, axis=0)).max(axis=1)
    if apart.max() < FAR * np.median(apart):
        return mesh, 0
    while len(kept) > 1:
        # The farthest from the middle of most vertices, and all that is nearly as far.
        apart = np.abs(vertices - np.median(vertices[np.unique(kept)], axis=0)).max(axis=1)
        far = apart[kept] > 0.5 * apart[kept].max()
        stray = far.all(axis=1)
        if np.any(far.any(axis=1) != stray) or not 0 < stray.sum() < 0.5 * len(kept):
            break
        rest, lost = vertices[np.unique(kept[~stray])], vertices[np.unique(kept[stray])]
        size = max(float(np.ptp(rest, axis=0).max()), LEAST_M)
        gap = float(np.maximum(lost - rest.max(axis=0), rest.min(axis=0) - lost).max(axis=1).min())
        if gap < FAR * size:
            break
        kept = kept[~stray]
    if len(kept) == count:
        return mesh, 0
    used, numbers = np.unique(kept, return_inverse=True)
    return (vertices[used], numbers.reshape(kept.shape)), count - len(kept)
