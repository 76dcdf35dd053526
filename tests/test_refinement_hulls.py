"""Hulls' distances in MuJoCo, where PyBullet is not installed: as by hand, as in PyBullet, and what is cut by them."""

from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from asset2sim.assets.meshes.hull import Boxes, boxes_meet, hull_of
from asset2sim.engines import static_object
from asset2sim.engines.static_object import MARGIN_M
from asset2sim.physics.arrays import Array
from asset2sim.refinement.collision import hull_world as hulls_near
from asset2sim.refinement.collision.part_links import cut_until_clear, hull_world
from asset2sim.refinement.collision.trim import Trimmer
from tests.builders import corners

pytestmark = pytest.mark.system

HERE = np.eye(4)
CUBE = corners((0.0, 0.0, 0.0), (0.1, 0.1, 0.1))


@pytest.fixture
def without_pybullet(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("asset2sim.refinement.collision.part_links", "asset2sim.engines.static_object"):
        monkeypatch.setattr(f"{module}.with_pybullet", lambda: False)


def at(x: float, y: float = 0.0, z: float = 0.0, turn: Rotation | None = None) -> Array:
    pose = np.eye(4)
    pose[:3, :3] = (turn or Rotation.identity()).as_matrix()
    pose[:3, 3] = x, y, z
    return pose


def rocks(seed: int) -> dict[str, tuple[Array, ...]]:
    numbers = np.random.default_rng(seed)
    found: dict[str, tuple[Array, ...]] = {}
    for name in ("a", "b"):
        hull = hull_of(numbers.normal(size=(12, 3)) * 0.05)
        assert hull is not None
        found[name] = (hull.points,)
    return found


@pytest.mark.usefixtures("without_pybullet")
@pytest.mark.parametrize(("shift", "gap"), [(0.13, 0.03), (0.095, -0.005), (0.1, 0.0)])
def test_two_cubes_are_as_far_apart_as_by_hand_less_the_margins(shift: float, gap: float) -> None:
    with hull_world(Trimmer({"a": (CUBE,), "b": (CUBE,)})) as world:
        found = world.closest(("a", 0), ("b", 0), HERE, at(shift, 0.01, 0.02), 1.0)
        assert found is not None
        assert found[0] == pytest.approx(gap - 2.0 * MARGIN_M, abs=1e-7)
        if gap != 0.0:
            np.testing.assert_allclose(found[1], (-1.0, 0.0, 0.0), atol=1e-6)  # the way that A leaves B
        assert world.closest(("a", 0), ("b", 0), HERE, at(shift, 0.01, 0.02), gap - 2.0 * MARGIN_M - 1e-4) is None


def test_hulls_at_random_poses_are_as_far_apart_as_in_pybullet(monkeypatch: pytest.MonkeyPatch) -> None:
    turns = Rotation.random(40, rng=5)
    seen: dict[bool, list[tuple[float, Array]]] = {}
    for bullet in (True, False):
        monkeypatch.setattr("asset2sim.refinement.collision.part_links.with_pybullet", lambda bullet=bullet: bullet)
        seen[bullet] = []
        with hull_world(Trimmer(rocks(3))) as world:
            for number, turn in enumerate(turns):
                found = world.closest(("a", 0), ("b", 0), HERE, at(0.06 + 0.006 * number, 0.01, 0.0, turn), 1.0)
                assert found is not None
                seen[bullet].append(found)
    pairs = list(zip(seen[True], seen[False], strict=True))
    assert {mine[0] < 0.0 for _, mine in pairs} == {True, False}
    for theirs, mine in pairs:
        assert mine[0] == pytest.approx(theirs[0], abs=2e-4)
        if abs(mine[0] + 2.0 * MARGIN_M) > 1e-3:
            assert float(mine[1] @ theirs[1]) > 0.99


@pytest.mark.usefixtures("without_pybullet")
def test_hulls_that_were_cut_in_mujoco_are_clear_in_pybullet(monkeypatch: pytest.MonkeyPatch) -> None:
    hulls, poses = rocks(4), {"a": HERE, "b": at(0.06)}
    cut, lost = cut_until_clear(hulls, poses, [("a", "b")])
    assert lost
    monkeypatch.setattr("asset2sim.refinement.collision.part_links.with_pybullet", lambda: True)
    for pieces, overlaps in ((hulls, True), (cut, False)):
        with hull_world(Trimmer(pieces)) as world:
            assert (world.overlap(("a", 0), ("b", 0), poses["a"], poses["b"], 0.0) is not None) is overlaps
    assert not static_object.with_pybullet()


def test_of_many_keys_only_neighbours_are_compared_piece_by_piece(monkeypatch: pytest.MonkeyPatch) -> None:
    keys: dict[str, tuple[Array, ...]] = {f"key{n}": (CUBE, CUBE + np.array([0.0, 0.0, 0.05])) for n in range(30)}
    poses = {name: at(0.1005 * number) for number, name in enumerate(keys)}
    pairs, calls = list(combinations(keys, 2)), list[Boxes]()

    def counted(first: Boxes, second: Boxes, slack: float) -> NDArray[np.bool_]:
        calls.append(first)
        return boxes_meet(first, second, slack)

    monkeypatch.setattr(hulls_near, "boxes_meet", counted)
    found = hulls_near.candidates(Trimmer(keys), poses, pairs)
    assert {(a[0], b[0]) for a, b in found} == {(f"key{n}", f"key{n + 1}") for n in range(29)}
    assert len(found) == 4 * 29 and len(calls) == 29
