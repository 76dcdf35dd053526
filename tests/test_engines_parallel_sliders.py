"""Pairs of sliders that never meet, by hand: keys on a plate, side by side, nested, crossing, too close or far."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from asset2sim.engines.parallel_sliders import never_meeting
from asset2sim.engines.pybullet_world import PyBulletWorld, open_pybullet
from schemas.base import Vector3
from tests.builders import UrdfJoint, UrdfLink, box, write_urdf

SKIN_M = PyBulletWorld.skin_m
Z, TILTED = (0.0, 0.0, 1.0), (0.0, 0.6, 0.8)
Shape = tuple[str, Vector3]
KEY: tuple[Shape, ...] = ((box(0.018, 0.018, 0.006), (0.0, 0.0, 0.0)),)
AN_L: tuple[Shape, ...] = ((box(0.018, 0.038, 0.006), (0.0, 0.0, 0.0)), (box(0.018, 0.018, 0.006), (-0.018, 0.01, 0.0)))
"""A key of two pieces, 18 mm wide, to whose left there is room for another below a half of twice that width."""
Key = tuple[tuple[Shape, ...], Vector3, Vector3]


def plate(folder: Path, keys: Sequence[Key], kind: str = "prismatic") -> Path:
    """A plate 10 mm below keys of these shapes, at these places, on joints along these axes."""
    links = [UrdfLink("base", 1.0, shapes=((box(0.2, 0.2, 0.002), (0.0, 0.0, -0.02)),))]
    links += [UrdfLink(f"key_{i}", 0.1, shapes=shapes) for i, (shapes, _, _) in enumerate(keys)]
    joints = [
        UrdfJoint(f"joint_{i}", kind, "base", f"key_{i}", axis, place, -0.003, 0.0)
        for i, (_, place, axis) in enumerate(keys)
    ]
    return write_urdf(folder, links, joints)


@pytest.mark.parametrize(
    ("keys", "kind", "never"),
    [
        # 2.1 mm apart, PyBullet's margins being 2 mm together.
        ([(KEY, (0.0, 0.0, 0.0), Z), (KEY, (0.0201, 0.0, 0.0), Z)], "prismatic", True),
        ([(KEY, (0.0, 0.0, 0.0), Z), (KEY, (0.0199, 0.0, 0.0), Z)], "prismatic", False),
        # The same axis the other way round, and a height that does not matter.
        ([(KEY, (0.0, 0.0, 0.0), Z), (KEY, (0.0201, 0.0, 0.05), (0.0, 0.0, -1.0))], "prismatic", True),
        # Along the diagonal squares of 18 mm come as close as along their sides: 1.414 * 1 mm is too close.
        ([(KEY, (0.0, 0.0, 0.0), Z), (KEY, (0.0201, 0.0201, 0.0), Z)], "prismatic", True),
        ([(KEY, (0.0, 0.0, 0.0), Z), (KEY, (0.019, 0.019, 0.0), Z)], "prismatic", False),
        # One above the other, which meet on their way.
        ([(KEY, (0.0, 0.0, 0.0), Z), (KEY, (0.0, 0.0, 0.02), Z)], "prismatic", False),
        # Axes that are not parallel, and joints that turn.
        ([(KEY, (0.0, 0.0, 0.0), Z), (KEY, (0.0201, 0.0, 0.0), TILTED)], "prismatic", False),
        ([(KEY, (0.0, 0.0, 0.0), Z), (KEY, (0.0201, 0.0, 0.0), Z)], "revolute", False),
        # Seen along the tilted axis they are as far apart sideways, and not so upwards (18 and 6 mm: 14.4 + 3.6).
        ([(KEY, (0.0, 0.0, 0.0), TILTED), (KEY, (0.0201, 0.0, 0.0), TILTED)], "prismatic", True),
        ([(KEY, (0.0, 0.0, 0.0), TILTED), (KEY, (0.0, 0.024, 0.0), TILTED)], "prismatic", False),
        ([(KEY, (0.0, 0.0, 0.0), TILTED), (KEY, (0.0, 0.026, 0.0), TILTED)], "prismatic", True),
        # Nested: within the hull of the other's two pieces, and clear of both.
        ([(AN_L, (0.0, 0.0, 0.0), Z), (KEY, (-0.0205, -0.0105, 0.0), Z)], "prismatic", True),
        ([(AN_L, (0.0, 0.0, 0.0), Z), (KEY, (-0.0205, -0.0095, 0.0), Z)], "prismatic", False),
        # No neighbours: no engine makes contacts between them, and none is asked to leave them out.
        ([(KEY, (0.0, 0.0, 0.0), Z), (KEY, (0.09, 0.0, 0.0), Z)], "prismatic", False),
    ],
)
def test_sliders_side_by_side_never_meet(tmp_path: Path, keys: Sequence[Key], kind: str, never: bool) -> None:
    assert never_meeting(plate(tmp_path, keys, kind), SKIN_M) == ((("key_0", "key_1"),) if never else ())


@pytest.mark.system
def test_pybullet_makes_no_contact_where_it_would_bear_nothing_and_all_others(tmp_path: Path) -> None:
    keys = [(KEY, (0.0201 * i, 0.0, 0.0), Z) for i in range(2)]
    keys += [(KEY, (-0.0101, 0.0, 0.0), Z)]  # overlaps the first
    urdf = plate(tmp_path, keys)
    with open_pybullet(urdf, plane=False, timestep_s=1.0 / 240.0, contact_friction=0.5) as world:
        assert {(point.link_a, point.link_b) for point in world.contacts()} <= {("key_0", "key_2"), ("key_2", "key_0")}
        assert world.contacts()


def test_a_shape_that_is_written_anew_is_seen(tmp_path: Path) -> None:
    square = "v 0 0 0\nv 0.018 0 0\nv 0.018 0.018 0\nv 0 0.018 0\nv 0.009 0.009 0.006\n"
    sides = "f 1 3 2\nf 1 4 3\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n"
    (tmp_path / "key.obj").write_text(square + sides)
    shapes: tuple[Shape, ...] = (('<mesh filename="key.obj"/>', (0.0, 0.0, 0.0)),)
    urdf = plate(tmp_path, [(shapes, (0.0, 0.0, 0.0), Z), (shapes, (0.0205, 0.0, 0.0), Z)])
    assert never_meeting(urdf, SKIN_M)
    (tmp_path / "key.obj").write_text(square.replace("0.018", "0.019") + sides)
    assert not never_meeting(urdf, SKIN_M)
