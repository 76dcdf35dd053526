"""Pieces that stand over a flat floor are cut at it, and what is seen on a floor is not."""

import numpy as np
import pytest
import trimesh

from asset2sim.assets.meshes.patches import PatchPiece, piece_of
from asset2sim.physics.arrays import Array
from asset2sim.refinement.collision.floors import cut_at_floors, flat_floors

UP, RADIUS, CELL, SHEET = np.array([0.0, 0.0, 1.0]), 0.012, 0.006, 0.002


def board(low: tuple[float, float, float], high: tuple[float, float, float]) -> Array:
    """The faces of a box between two corners."""
    made = trimesh.creation.box(extents=np.subtract(high, low))
    return np.asarray(made.apply_translation(np.add(low, high) / 2.0).triangles)


FLOOR = board((-0.2, -0.15, -0.02), (0.2, 0.15, 0.0))
WALL = board((0.2, -0.15, -0.02), (0.21, 0.15, 0.2))


def leaning(left: float, right: float) -> PatchPiece:
    """A slab from 2 cm under the floor to so far above it, m."""
    corners = [(x, y, z) for x, top in ((-0.2, left), (0.2, right)) for y in (-0.15, 0.15) for z in (-0.02, top)]
    return piece_of(np.array(corners), SHEET)


def top(piece: PatchPiece) -> float:
    return float(piece.points[:, 2].max())


def cut(piece: PatchPiece, *seen: Array) -> PatchPiece:
    wall = piece_of(WALL.reshape(-1, 3), SHEET)
    (found, kept) = cut_at_floors([piece, wall], np.vstack([FLOOR, WALL, *seen]), UP, RADIUS, CELL, SHEET)
    assert np.array_equal(kept.points, wall.points), "a wall that stands beside the floor stays"
    return found


def test_a_slab_that_leans_over_a_flat_floor_is_cut_at_it() -> None:
    found = cut(leaning(0.004, 0.009))
    assert top(found) == pytest.approx(0.0, abs=1e-9) and found.volume == pytest.approx(0.4 * 0.3 * 0.02, rel=1e-6)
    assert top(cut(leaning(-0.002, 0.009))) == pytest.approx(0.0, abs=1e-9), "also where it begins below"


def test_a_plate_a_rim_and_what_is_high_stay() -> None:
    plate = board((-0.19, -0.14, 0.0001), (0.19, 0.14, 0.005))
    assert top(cut(leaning(0.005, 0.005), plate)) == pytest.approx(0.005, abs=1e-4), "it is seen there"
    assert top(cut(leaning(0.03, 0.03))) == 0.03, "higher than what the pieces' hollow lets pass: it is filled"
    rounded = board((-0.2, -0.15, 0.0), (-0.19, 0.15, 0.008))
    assert top(cut(leaning(0.008, 0.008), rounded)) == pytest.approx(0.0, abs=1e-9), "an edge is less than the floor"


def test_floors_are_flat_level_and_large_enough_for_a_ball() -> None:
    both = [floor.height for floor in flat_floors(FLOOR, UP, RADIUS)]
    assert sorted(both) == pytest.approx([-0.02, 0.0], abs=1e-9), "its top and its underside"
    assert flat_floors(FLOOR * 0.1, UP, RADIUS) == [] == flat_floors(FLOOR, np.array([1.0, 0.0, 0.0]), RADIUS * 3.0)
