"""A ball set into an interior stays there only if the collision shapes have that interior, and hold it."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import write_folder
from asset2sim.assets.hulls import Hulls, collision_hulls
from asset2sim.physics.arrays import Array
from asset2sim.refinement.collision.shapes import collision_shapes
from asset2sim.validation.validate import validate
from schemas.overlay import Overlay
from schemas.settings import CollisionSettings, PhysicsSettings
from schemas.vocabulary import Source
from tests.assets import read
from tests.interior import cavity, interiors
from tests.marks import OBJECTS, needs_objects
from tests.test_refinement_shapes import case

pytestmark = pytest.mark.system

PHYSICS = PhysicsSettings()
NOTHING = np.zeros((0, 3, 3))
ROW = np.linspace(-0.08, 0.08, 9)
REAL = (("TrashCan/102155", 0.25, ""), ("Microwave/7221", 0.3, "body"), ("Table/20279", 0.8, "drawer"))


def refined(item: Extraction, scale: float, hulls: Hulls, target: Path) -> Path:
    overlay, _ = validate(item, Overlay(scale=scale), Source.MODEL, 0.5, PHYSICS)
    write_folder(item, overlay, hulls, target, PHYSICS)
    return target


def pot(height: float = 0.1) -> Array:
    """The faces of an upright pot of 0.2 x 0.2 m with walls of 1 cm."""
    walls = [((0.2, 0.01, height), (0, y, 0)) for y in (-0.1, 0.1)] + [
        ((0.01, 0.2, height), (x, 0, 0)) for x in (-0.1, 0.1)
    ]
    parts = [((0.2, 0.2, 0.01), (0, 0, -height / 2)), *walls]
    made = [trimesh.creation.box(extents=size).apply_translation(at) for size, at in parts]
    return np.vstack([np.asarray(part.triangles) for part in made])


def test_the_interior_of_a_pot_is_in_its_middle() -> None:
    point = cavity(pot(), NOTHING, 0.01)
    assert point is not None
    assert np.abs(point[:2]).max() < 0.03 and -0.04 < point[2] < 0.05


def test_what_has_no_floor_no_room_or_no_way_in_has_no_interior() -> None:
    upside_down = pot() * (1.0, 1.0, -1.0)
    assert cavity(upside_down, NOTHING, 0.01) is None
    assert cavity(pot() * 0.08, NOTHING, 0.01) is None
    slot = pot() * (0.18, 1.0, 1.0)  # 34 mm wide: balls of 2 cm lie in it one behind the other
    assert cavity(slot, NOTHING, 0.01) is None and cavity(pot() * (0.3, 1.0, 1.0), NOTHING, 0.01) is not None
    lid = np.asarray(trimesh.creation.box(extents=(0.22, 0.22, 0.01)).apply_translation((0, 0, 0.05)).triangles)
    assert cavity(np.vstack([pot(), lid]), NOTHING, 0.01) is None
    # Another link's lid closes the pot without taking its interior away, what stands in it leaves no room.
    assert cavity(pot(), lid, 0.01) is not None
    sticks = [trimesh.creation.box(extents=(0.005, 0.005, 0.2)).apply_translation((x, y, 0)) for x in ROW for y in ROW]
    assert cavity(pot(), np.vstack([np.asarray(stick.triangles) for stick in sticks]), 0.01) is None


def test_a_ball_stays_in_pieces_and_not_in_a_hull_or_through_a_floor(tmp_path: Path) -> None:
    item = read(case(tmp_path / "case"))
    hulls, _ = collision_shapes(item, 1.0, CollisionSettings())
    (held,) = interiors(refined(item, 1.0, hulls, tmp_path / "pieces"))
    assert held.link == "body" and held.holds and held.overlap_m == 0.0
    (filled,) = interiors(refined(item, 1.0, collision_hulls(item, 1.0), tmp_path / "hull"))
    assert not filled.holds and filled.overlap_m > 0.05
    floor = min(range(5), key=lambda index: hulls["body"][index][:, 2].max())
    walls = tuple(piece for index, piece in enumerate(hulls["body"]) if index != floor)
    (open_below,) = interiors(refined(item, 1.0, {**hulls, "body": walls}, tmp_path / "walls"))
    assert open_below.overlap_m == 0.0 and not open_below.stayed


@needs_objects
@pytest.mark.parametrize(("path", "scale", "label"), REAL)
def test_real_interiors_hold_a_ball(path: str, scale: float, label: str, tmp_path: Path) -> None:
    item = read(OBJECTS / path)
    hulls, _ = collision_shapes(item, scale, CollisionSettings())
    found = interiors(refined(item, scale, hulls, tmp_path / "asset"), (label,))
    assert found and all(interior.holds for interior in found)
