"""Convex pieces of one link: each shell's hull, or a decomposition where that hull fills a hollow."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from asset2sim.assets.extract import Extraction
from asset2sim.assets.hulls import without_enclosed
from asset2sim.assets.meshes.hollow import CELLS_A_RADIUS, Hollow, grid_over, hollow_of, samples
from asset2sim.assets.meshes.hull import distinct_faces, shells
from asset2sim.assets.meshes.patches import ENOUGH, PatchPiece, join_pieces, piece_of, pieces_around_hollow
from asset2sim.physics.arrays import Array
from asset2sim.refinement.collision.floors import cut_at_floors


@dataclass(frozen=True)
class Shell:
    """One shell: its (n, 3) vertices and (m, 3) faces, and the (k, 3) points of its hull, none where it is flat;
    ``exact``: the mesh is closed and convex, so that the hull equals it."""

    vertices: Array
    faces: NDArray[np.int64]
    hull: Array | None
    exact: bool

    @property
    def triangles(self) -> Array:
        """(m, 3, 3) corners of its faces."""
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
        if part.sheet is not None:
            found.append(Shell(placed, faces, None, False))
        elif part.exact:
            found.append(Shell(placed, faces, part.pieces[0], True))
        else:
            # The pieces are the hulls of its shells, made when it was read.
            all_faces = np.asarray(mesh.faces)
            for own, shell in zip(part.pieces, shells(mesh), strict=True):
                found.append(Shell(placed, single_sided(all_faces[shell.faces]), own, False))
    return found


def single_sided(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """(m, 3) faces without duplicates: the two sides of a sheet have the same corners."""
    return faces[np.sort(distinct_faces(faces))]


LEAST_BALLS = 2.0
"""Hollow volume that a hull may always fill, in ball volumes: less can hold nothing."""
FILLED_SHARE = 0.05
"""Hollow volume that a hull may fill, over its own volume: less is a rounded edge or a recess."""
MOST_BALLS = 30.0
"""Upper bound on that hollow volume, in ball volumes: more is, for example, a drawer in a large body."""
ADDED_SHARE = 0.1
"""Volume that joining two pieces may add, over the smaller one's volume: faceting a curve loses about as much."""
DECAL_SHARE = 0.9
"""Share of a sheet on the link's solids from which it counts as a decal; a sheet across a gap is a wall or pane."""


@dataclass(frozen=True)
class Sizes:
    """Lengths at the authored scale, m: radius of the ball that defines a hollow, and thickness given to sheets."""

    ball_radius: float
    thickness: float

    @property
    def ball_volume(self) -> float:
        """Volume of the ball, m³."""
        return 4.0 / 3.0 * np.pi * self.ball_radius**3


@dataclass(frozen=True)
class LinkPieces:
    """A link's pieces, its hollow (None where no shell is large enough), and counts of shells cut and sheets handled.

    ``filled_before`` is the hollow volume filled by the shells' hulls, ``allowed`` the volume that they may fill, m³.
    """

    pieces: list[PatchPiece]
    hollow: Hollow | None
    cut_shells: int
    decals: int
    walls: int
    filled_before: float
    allowed: float

    @cached_property
    def filled(self) -> float:
        """Hollow volume filled by the pieces, m³; where two pieces overlap it counts twice."""
        return 0.0 if self.hollow is None else sum(self.hollow.filled_m3(piece.points) for piece in self.pieces)


def link_pieces(shells: Sequence[Shell], others: Callable[[], Array], sizes: Sizes, most: int) -> LinkPieces:
    """Convex pieces of one link's shells, at most ``most``; ``others`` returns (n, 3) points that other links reach.

    Sheets that lie on the link's solids are left out; other sheets become thin walls.
    """
    solids, sheets = [s for s in shells if s.hull is not None], [s for s in shells if s.hull is None]
    walls = standing_sheets(sheets, solids, sizes) if solids else sheets
    used = [*solids, *walls]
    worth = any(can_be_hollow(shell, sizes) for shell in used) or len(used) > most
    hollow = hollow_of(np.vstack([s.triangles for s in used]), sizes.ball_radius) if worth else None
    if hollow is not None:
        hollow = hollow.with_reachable(others())
    wholes = [whole_of(shell, sizes) for shell in used]
    pairs = list(zip(used, wholes, strict=True))
    fills = [0.0 if hollow is None or s.exact else hollow.filled_m3(w.points) for s, w in pairs]
    pieces: list[PatchPiece] = []
    cuts: list[list[PatchPiece]] = []
    for (shell, whole), filled in zip(pairs, fills, strict=True):
        if hollow is not None and must_be_cut(shell, whole, filled, hollow, sizes):
            cuts.append(pieces_around_hollow(shell.vertices, shell.faces, hollow, sizes.thickness))
        else:
            pieces.append(whole)
    cut_pieces = [piece for own in cuts for piece in own]
    if len(cuts) > 1:  # the inner and the outer side of a wall may be two shells
        cut_pieces = join_pieces(cut_pieces, hollow, sizes.thickness, enough=ENOUGH)
    kept = [piece_of(points, 0.0) for points in without_enclosed([piece.points for piece in [*pieces, *cut_pieces]])]
    return LinkPieces(
        pieces=join_pieces(kept, hollow, sizes.thickness, most=most, added_share=ADDED_SHARE),
        hollow=hollow,
        cut_shells=sum(len(own) > 1 for own in cuts),
        decals=len(sheets) - len(walls),
        walls=len(walls),
        filled_before=sum(fills),
        allowed=sum(allowed_fill(whole.volume, sizes) for whole in wholes),
    )


def whole_of(shell: Shell, sizes: Sizes) -> PatchPiece:
    """Hull of a shell; a sheet becomes a thin wall."""
    points = shell.vertices[np.unique(shell.faces)] if shell.hull is None else shell.hull
    return piece_of(points, sizes.thickness)


def must_be_cut(shell: Shell, whole: PatchPiece, filled: float, hollow: Hollow, sizes: Sizes) -> bool:
    """Whether a shell's hull fills more of the hollow (``filled``, m³) than allowed, or covers an opening of it."""
    if shell.exact:
        return False
    if filled > allowed_fill(whole.volume, sizes):
        return True
    # A frame, a bail or a ring is thinner than the hollow's cells: the opening that it covers is measured as an area.
    area = float(np.linalg.norm(np.cross(*np.diff(whole.triangles, axis=1).swapaxes(0, 1)), axis=1).sum()) / 2.0
    thin = 2.0 * whole.volume < sizes.ball_radius * area
    return thin and hollow.opened_m2(whole.triangles) > LEAST_BALLS * np.pi * sizes.ball_radius**2


def with_at_most(link: LinkPieces, sizes: Sizes, most: int) -> LinkPieces:
    """The same link with at most ``most`` pieces."""
    if len(link.pieces) <= most:
        return link
    return replace(
        link, pieces=join_pieces(link.pieces, link.hollow, sizes.thickness, most=most, added_share=ADDED_SHARE)
    )


def on_floors(link: LinkPieces, looks: Array | None, up: Array, sizes: Sizes) -> LinkPieces:
    """The same link, its pieces cut at the flat floors of its ``looks``, (k, 3, 3) triangles; ``up`` is the (3,) upward
    direction in its frame at rest."""
    if looks is None:
        return link
    cell_m = sizes.ball_radius / CELLS_A_RADIUS if link.hollow is None else link.hollow.cell_m
    return replace(link, pieces=cut_at_floors(link.pieces, looks, up, sizes.ball_radius, cell_m, sizes.thickness))


def allowed_fill(hull_volume: float, sizes: Sizes) -> float:
    """Hollow volume (m³) that a hull may fill and still be used for its shell."""
    share = min(FILLED_SHARE * hull_volume, MOST_BALLS * sizes.ball_volume)
    return max(LEAST_BALLS * sizes.ball_volume, share)


def can_be_hollow(shell: Shell, sizes: Sizes) -> bool:
    """Whether a shell is not exactly convex and at least as wide as the ball in two directions."""
    widths = np.sort(np.ptp(shell.vertices[np.unique(shell.faces)], axis=0))
    return not shell.exact and bool(widths[1] >= 2.0 * sizes.ball_radius)


def standing_sheets(sheets: Sequence[Shell], solids: Sequence[Shell], sizes: Sizes) -> list[Shell]:
    """Sheets larger than the ball that do not lie on the solids or within one cell of them."""
    large = [sheet for sheet in sheets if can_be_hollow(sheet, sizes)]
    if not large:
        return []
    grid, _ = grid_over(np.vstack([s.triangles for s in [*solids, *large]]), sizes.ball_radius)
    taken = np.zeros(grid.depth.shape, dtype=bool)
    index = grid.cells(np.vstack([samples(s.triangles, grid.cell_m / 2.0) for s in solids]))
    taken[index[:, 0], index[:, 1], index[:, 2]] = True
    near = ndimage.binary_dilation(taken, np.ones((3, 3, 3), dtype=bool))
    found = []
    for sheet in large:
        index = grid.cells(samples(sheet.triangles, grid.cell_m))
        if float(near[index[:, 0], index[:, 1], index[:, 2]].mean()) < DECAL_SHARE:
            found.append(sheet)
    return found
