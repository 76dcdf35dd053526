"""Pieces of a case that lie over its keys where nothing is drawn are cut down to where the keys go, and no others."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import trimesh

from asset2sim.assets.hulls import Hulls
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint
from asset2sim.refinement.collision.let_joints_move import let_joints_move
from asset2sim.refinement.collision.press_room import room_for_presses
from asset2sim.refinement.collision.trim import CLEARANCE_M, Cut, PlaneCut, cut_again, cuts_of
from asset2sim.refinement.context import Log, RefinementContext
from schemas.overlay import PhysicsOverlay
from schemas.settings import Settings
from schemas.support import Support, SupportKind
from schemas.vocabulary import Source
from tests.assets import joint, link, read, robot, shape, written
from tests.factories import make_joint

WAY_M, FRONT_M = 0.003, 0.002
DEEPEST = FRONT_M - WAY_M - CLEARANCE_M
"""Where the plane lies to which a lid is cut, m: the key's front stands 2 mm out of the case and goes 3 mm."""


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Any:
    made = trimesh.creation.box(extents=np.subtract(high, low))
    return made.apply_translation(np.add(low, high) / 2.0)


KEY = box((-0.009, -0.009, -0.004), (0.009, 0.009, FRONT_M))
WALLS = [box((x, -0.05, -0.01), (x + 0.004, 0.05, 0.0)) for x in (-0.05, 0.046)]


def cut(lid: Any, *drawn: Any, **changes: float | str | None) -> tuple[Hulls, list[Cut], list[PlaneCut]]:
    meshes = {"case": trimesh.util.concatenate([*WALLS, *drawn]), "key": KEY}
    shapes = SimpleNamespace(read=lambda link: (meshes[link].vertices, meshes[link].faces), scale=1.0)
    joint = {"name": "press", "type": "prismatic", "stiffness": 100.0, "mimic": None, "spring_reference": -0.001}
    joint |= {"lower": 0.0, "upper": WAY_M, **changes}
    tree = [TreeJoint("press", "prismatic", "case", "key", np.eye(4), np.array([0.0, 0.0, -1.0]))]
    hulls = {"case": tuple(np.array(piece.vertices) for piece in (*WALLS, lid)), "key": (np.array(KEY.vertices),)}
    planes = list[PlaneCut]()
    found, cuts = room_for_presses(
        hulls, cast(Any, [SimpleNamespace(**joint)]), tree, "case", cast(Any, shapes), planes
    )
    assert all(one is other for one, other in zip(found["case"][:2], hulls["case"], strict=False)), "walls stay"
    return found, cuts, planes


def top(found: Hulls) -> float:
    lid: Array = found["case"][2]
    return float(lid[:, 2].max())


def test_a_lid_over_a_key_is_cut_to_where_the_key_goes() -> None:
    thick = box((-0.05, -0.05, -0.003), (0.05, 0.05, 0.0002))
    found, (one,), (plane,) = cut(thick)
    assert top(found) == pytest.approx(DEEPEST, abs=1e-9)
    assert (one.link, one.other) == ("case", "key") and one.depth_m == pytest.approx(0.0002 - DEEPEST)
    assert plane.left is found["case"][2], "so that a replay cuts it again"
    assert found["key"][0] is not None and float(found["key"][0][:, 2].max()) == pytest.approx(FRONT_M)


def test_a_lid_that_is_drawn_beside_the_key_is_split_there_and_stays_there() -> None:
    lid, drawn = box((-0.05, -0.05, -0.003), (0.05, 0.05, 0.0002)), box((0.012, -0.045, -0.003), (0.045, 0.045, 0.0))
    found, (one,), planes = cut(lid, drawn)
    low, high = (np.array(piece) for piece in found["case"][2:])
    assert low[:, 2].max() == pytest.approx(DEEPEST, abs=1e-9) and high[:, 2].max() == pytest.approx(0.0002)
    assert low[:, 0].max() == pytest.approx(high[:, 0].min()) == pytest.approx(0.008, abs=1e-4), "a fingertip's edge"
    assert one.depth_m == pytest.approx(0.0002 - DEEPEST)
    hulls = {"case": (*found["case"][:2], np.array(lid.vertices)), "key": found["key"]}
    whole = {"case": (*found["case"][:2], planes[0].of), "key": found["key"]}
    again = cut_again(hulls, cuts_of(whole, found, planes))
    assert all(np.allclose(a, b) for a, b in zip(again["case"], found["case"], strict=True)), "a replay makes both"


def test_what_is_drawn_and_what_is_no_key_leave_it() -> None:
    thick = box((-0.05, -0.05, -0.003), (0.05, 0.05, 0.0002))
    plate = box((-0.045, -0.045, -0.003), (0.045, 0.045, 0.0))
    assert cut(thick, plate)[1] == [], "the case is drawn there"
    around = [box((x, -0.045, -0.003), (x + 0.03, 0.045, 0.0)) for x in (-0.042, 0.012)]
    around += [box((-0.012, y, -0.003), (0.012, y + 0.03, 0.0)) for y in (-0.042, 0.012)]
    assert cut(thick, *around)[1] == [], "more would be lost than is laid free on every side"
    assert cut(thick, stiffness=0.0)[1] == [] == cut(thick, type="revolute")[1] == cut(thick, upper=None)[1]
    assert cut(thick, upper=0.0015)[1] == [], "it goes no deeper than the lid lets it"
    assert cut(box((-0.05, -0.05, -0.001), (0.05, 0.05, 0.0002)))[1] == [], "nothing would be left of it"


@pytest.mark.system
def test_the_step_that_lets_joints_move_cuts_such_a_lid_and_says_so(tmp_path: Path) -> None:
    walls = [shape("0.004 0.1 0.01", "visual", f"{x} 0 -0.005") for x in (-0.048, 0.048)]
    key = shape("0.018 0.018 0.006", "visual", f"0 0 {FRONT_M - 0.003}")
    press = joint("press", "prismatic", "case", "key", axis="0 0 -1", limit=f"0 {WAY_M}")
    item = read(written(tmp_path / "thing", robot(link("case", "".join(walls)), link("key", key), press)))
    sprung = {"lower": 0.0, "upper": WAY_M, "open": WAY_M, "stiffness": 100.0, "spring_reference": -0.001}
    overlay = PhysicsOverlay(
        asset_id="1", scale=1.0, scale_source=Source.RULE, contact_friction=0.8, links=(),
        joints=(make_joint("press", "prismatic", 0.0).model_copy(update=sprung),),
        support=Support(kind=SupportKind.HANDHELD, source=Source.RULE),
    )  # fmt: skip
    lid = box((-0.05, -0.05, -0.003), (0.05, 0.05, -0.0005))
    hulls = {"case": tuple(np.array(piece.vertices) for piece in (*WALLS, lid)), "key": (np.array(KEY.vertices),)}
    loop = RefinementContext(item, cast(Any, None), overlay, Source.RULE, hulls, Settings(), Log())
    after, found = let_joints_move(loop, overlay, hulls)
    assert top(found) == pytest.approx(DEEPEST, abs=1e-9) and after.joints == overlay.joints
    (said,) = [finding for finding in loop.log.findings if finding.code == "collision_cut"]
    assert "where it would stop a finger on 'key'" in said.message and said.link == "case"
    assert len(loop.log.planes) == 1, "so that a replay cuts it again"
