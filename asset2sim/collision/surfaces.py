"""The faces that a link's collision shapes stand for, shell by shell, in the link's frame at the authored scale."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asset2sim.assets.extract import Extraction
from asset2sim.assets.meshes.hull import hull_of
from asset2sim.assets.meshes.shells import shells
from asset2sim.physics.arrays import Array


@dataclass(frozen=True)
class Shell:
    """One shell: its (n, 3) vertices and (m, 3) faces, and the (k, 3) points of its hull, none where it is flat.

    ``exact`` says that its mesh is closed and convex, so that the hull is its very shape.
    """

    vertices: Array
    faces: NDArray[np.int64]
    hull: Array | None
    exact: bool

    @property
    def triangles(self) -> Array:
        """(m, 3, 3) its faces."""
        return self.vertices[self.faces]


def link_shells(extraction: Extraction, link: str) -> list[Shell]:
    """The shells of one link's meshes. Primitives have none."""
    found: list[Shell] = []
    for part in extraction.geometry[link].parts:
        file = extraction.mesh_files.get(part.reference)
        if file is None:
            continue
        mesh = extraction.triangles.mesh(file, part.scale)
        faces = single_sided(np.asarray(mesh.faces))
        placed = np.asarray(mesh.vertices, dtype=float) @ part.rotation.T + part.translation
        whole = hull_of(np.asarray(mesh.vertices, dtype=float))
        if whole is None or part.sheet is not None:
            found.append(Shell(placed, faces, None, False))
        elif part.exact:
            found.append(Shell(placed, faces, part.pieces[0], True))
        else:
            all_faces = np.asarray(mesh.faces)
            for shell in shells(mesh, whole):
                own = shell.hull.points @ part.rotation.T + part.translation
                found.append(Shell(placed, single_sided(all_faces[shell.faces]), own, False))
    return found


def single_sided(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """The (m, 3) faces without those that have the same corners as an earlier one, as both sides of a sheet do."""
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return faces[np.sort(first)]
