"""The check ``contents``: what lies in a drawer or a box stays there, and what must not be taken for that, planted."""

from pathlib import Path
from typing import Any, cast

import pytest
from pydantic import TypeAdapter

pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
from asset2sim.assets.authored import read_overlay
from asset2sim.gym.hand.content_world import ContentWorld, orders_of_use
from asset2sim.gym.hand.contents import Kept, content_records
from schemas.asset import AssetRecord, AssetRef
from schemas.hand_settings import ContentSettings, HandSettings
from schemas.overlay import JointPhysics
from schemas.settings import Settings
from tasks.by_hand import contents_columns, measure_contents
from tasks.progress import AssetJob
from tests.assets import joint, link, prior, robot, shape
from tests.factories import make_joint
from tests.refined_things import Solid, inertial, refined, two

pytestmark = pytest.mark.system
BOTH = "visual collision"


def tray(floor: str = BOTH, walls: str = BOTH) -> str:
    """A tray of 30 x 24 x 10 cm inside, open above, 5 mm thick; what is seen of it and what collides can differ."""
    sides = [shape("0.3 0.005 0.1", walls, f"0 {y} 0.05") for y in (-0.12, 0.12)]
    sides += [shape("0.005 0.24 0.1", walls, f"{x} 0 0.05") for x in (-0.15, 0.15)]
    return shape("0.3 0.24 0.005", floor) + "".join(sides)


def chest(folder: Path, inside: str, **terms: Any) -> Path:
    """A shell with a drawer along x in it, of these shapes."""
    shell = shape("0.34 0.3 0.01", xyz="0 0 0.005") + shape("0.34 0.3 0.01", xyz="0 0 0.16")
    shell += "".join(shape("0.34 0.01 0.16", xyz=f"0 {y} 0.08") for y in (-0.145, 0.145))
    known = {"friction": 3.0, "damping": 5.0, "holds": True, "effective_inertia": 0.8} | terms
    return two(folder, Solid(shell, 8.0, 0.3), Solid(inside, 0.8, 0.2), "prismatic", "0 0 0.03", "1 0 0", 0.25,
               names=("drawer", "slide"), **known)  # fmt: skip


def box(folder: Path, below: str = "", sides: str = "") -> Path:
    """A box on the floor with a lid on a hinge along y at its back, under which ``below`` is fixed; its shapes are the
    tray's or these."""
    lid = Solid(shape("0.3 0.24 0.005", xyz="0.15 0 0") + below, 0.2, 0.2)
    return two(folder, Solid(sides or tray(), 1.0, 0.2), lid, "revolute", "-0.15 0 0.106", "0 -1 0", 1.9,
               names=("lid", "hinge"), friction=0.4, damping=0.05, holds=True, effective_inertia=0.006)  # fmt: skip


def kept(folder: Path) -> list[Kept]:
    return content_records(folder, read_overlay(folder), HandSettings(), ContentSettings())


def test_what_lies_in_a_drawer_and_in_a_box_stays(tmp_path: Path) -> None:
    (drawer,) = [item for item in kept(chest(tmp_path / "chest", tray())) if item.link == "drawer"]
    assert (drawer.reason, drawer.joints, drawer.free) == ("", ("slide",), 1.0)
    # Balls of 2 cm lie from 1.5 cm off each face: the mesh leaves 26.5 x 20.5 x 8.75 cm to their middles, to a cell.
    assert drawer.room_m3 == pytest.approx(0.265 * 0.205 * 0.0875, rel=0.15) and 0.03 < drawer.size_m <= 0.06
    (inside,) = kept(box(tmp_path / "box"))
    assert (inside.link, inside.reason, inside.joints) == ("body", "", ("hinge",))


def test_what_lies_behind_a_door_that_slides_is_looked_at(tmp_path: Path) -> None:
    shell = shape("0.3 0.4 0.01", xyz="0 0 0.005") + shape("0.3 0.4 0.01", xyz="0 0 0.295")
    shell += shape("0.01 0.4 0.3", xyz="-0.145 0 0.15")
    shell += "".join(shape("0.3 0.01 0.3", xyz=f"0 {y} 0.15") for y in (-0.195, 0.195))
    door = Solid(shape("0.008 0.4 0.3"), 0.5, 0.2)
    folder = two(tmp_path / "cupboard", Solid(shell, 8.0, 0.3), door, "prismatic", "0.158 0 0.15", "0 1 0", 0.38,
                 names=("door", "slide"), friction=2.0, damping=3.0, holds=True, effective_inertia=0.5)  # fmt: skip
    (inside,) = kept(folder)
    assert (inside.link, inside.reason, inside.joints) == ("body", "", ("slide",))


def test_the_way_of_a_door_that_slides_is_no_room(tmp_path: Path) -> None:
    """Two doors side by side, the right one 5 cm before the left: before the left one nothing lies for long."""
    shell = shape("0.36 0.4 0.01", xyz="0.035 0 0.005") + shape("0.36 0.4 0.01", xyz="0.035 0 0.295")
    shell += shape("0.01 0.4 0.3", xyz="-0.145 0 0.15")
    shell += "".join(shape("0.36 0.01 0.3", xyz=f"0.035 {y} 0.15") for y in (-0.195, 0.195))
    doors = {"left": "0.15 -0.095 0.15", "right": "0.2 0.095 0.15"}
    links = [Solid(shell, 8.0, 0.3).link("body")] + [
        Solid(shape("0.008 0.19 0.27"), 0.5, 0.2).link(name) for name in doors
    ]
    slides = [
        joint(f"slide_{name}", "prismatic", "body", name, xyz=place, axis=f"0 {1 if name == 'left' else -1} 0",
              limit="0 0.19")
        for name, place in doors.items()
    ]  # fmt: skip
    terms = {"upper": 0.19, "open": 0.19, "friction": 2.0, "damping": 3.0, "holds": True, "effective_inertia": 0.5}
    joints = [make_joint(f"slide_{name}", "prismatic").model_copy(update=terms) for name in doors]
    masses = {"body": 8.0} | dict.fromkeys(doors, 0.5)
    found = kept(refined(tmp_path / "cupboard", robot(*links, *slides), joints, masses, fixed=False))
    (inside,) = found
    # Behind the left door's way: 25 x 34.5 x 25 cm, to a cell, for the middles of balls of 2 cm.
    assert inside.reason == "" and inside.room_m3 == pytest.approx(0.25 * 0.345 * 0.25, rel=0.1), inside


def things(folder: Path, body: Solid, parts: dict[str, tuple[Solid, str, str, str, float]]) -> Path:
    """A body with parts, each with the kind, place, axis and range of its joint of the same name, which holds."""
    links = [body.link("body"), *(part.link(name) for name, (part, *_) in parts.items())]
    moved = [
        joint(f"{name}_joint", kind, "body", name, xyz=place, axis=axis, limit=f"0 {upper}")
        for name, (_, kind, place, axis, upper) in parts.items()
    ]
    owned = [
        make_joint(f"{name}_joint", kind).model_copy(
            update={"upper": upper, "open": upper, "friction": 0.5, "damping": 0.2, "holds": True,
                    "effective_inertia": 0.05}
        )
        for name, (_, kind, _, _, upper) in parts.items()
    ]  # fmt: skip
    masses = {"body": body.mass} | {name: part.mass for name, (part, *_) in parts.items()}
    return refined(folder, robot(*links, *moved), owned, masses)


def test_a_door_before_a_drawer_is_opened_first_and_all_the_way(tmp_path: Path) -> None:
    """A rack low in a machine whose door turns down to the level at which the rack comes out, and no further."""
    shell = shape("0.5 0.5 0.01", xyz="0 0 0.005") + shape("0.5 0.5 0.01", xyz="0 0 0.395")
    shell += "".join(shape("0.5 0.01 0.4", xyz=f"0 {y} 0.2") for y in (-0.245, 0.245))
    parts = {
        "door": (
            Solid(shape("0.02 0.48 0.36", xyz="0.01 0 0.18"), 2.0, 0.3),
            "revolute",
            "0.252 0 0.022",
            "0 1 0",
            1.5,
        ),
        "rack": (
            Solid(tray() + shape("0.005 0.24 0.2", xyz="0.15 0 0.1"), 0.8, 0.2),
            "prismatic",
            "0.05 0 0.055",
            "1 0 0",
            0.3,
        ),
    }
    found = {item.link: item for item in kept(things(tmp_path / "washer", Solid(shell, 20.0, 0.4), parts))}
    assert found["rack"].joints == ("door_joint", "rack_joint")
    assert (found["rack"].reason, found["rack"].shut) == ("", False)


def test_the_way_of_a_drawer_is_no_room(tmp_path: Path) -> None:
    """A drawer that stands back in a cupboard: what is put down before it would be pushed out with it."""
    shell = shape("0.6 0.3 0.01", xyz="0.1 0 0.005") + shape("0.6 0.3 0.01", xyz="0.1 0 0.495")
    shell += "".join(shape("0.6 0.01 0.5", xyz=f"0.1 {y} 0.25") for y in (-0.145, 0.145))
    shell += shape("0.01 0.3 0.5", xyz="-0.195 0 0.25") + shape("0.34 0.28 0.01", xyz="-0.03 0 0.2")
    parts = {
        "door": (
            Solid(shape("0.01 0.29 0.49", xyz="0 0.145 0"), 2.0, 0.3),
            "revolute",
            "0.41 -0.145 0.25",
            "0 0 -1",
            1.9,
        ),
        "drawer": (Solid(tray(), 0.8, 0.2), "prismatic", "-0.02 0 0.02", "1 0 0", 0.28),
    }
    found = kept(things(tmp_path / "fridge", Solid(shell, 20.0, 0.4), parts))
    assert {item.link: item.reason for item in found} == {"body": "", "drawer": ""}


class Flaps:
    """A flap over another, which pushes it open and does not shut below it."""

    hand = HandSettings()

    def __init__(self) -> None:
        self.at, self.led = {"under": 0.0, "over": 0.0}, dict[str, float]()

    def position(self, joint: str) -> float:
        return self.at[joint]

    def lead(self, joint: JointPhysics, target: float) -> None:
        self.led[joint.name] = target
        if joint.name == "under" and target > self.at["under"]:
            self.at["over"] = target
        if joint.name == "over" or target > 0.0 or self.at["over"] > 0.0:
            self.at[joint.name] = target


def test_flaps_are_shut_in_the_order_in_which_they_lie() -> None:
    under, over = (make_joint(name, "revolute") for name in ("under", "over"))
    opened, closed, stuck = orders_of_use(cast(ContentWorld, Flaps()), [under, over])
    assert (opened, closed, stuck) == ([under, over], [under, over], "")


def test_what_is_put_down_on_a_floor_that_leans_lies_there_and_rolls_to_its_edge(tmp_path: Path) -> None:
    """A trough with sides that lean by 35°, as a jewellery box's wells have: balls roll to its middle and stay."""
    sides = "".join(
        shape("0.3 0.2 0.005", BOTH, f"0 {y} 0.05").replace("<origin", f'<origin rpy="{lean} 0 0"')
        for y, lean in ((-0.08, -0.61), (0.08, 0.61))
    )
    ends = "".join(shape("0.005 0.34 0.12", BOTH, f"{x} 0 0.06") for x in (-0.15, 0.15))
    (inside,) = kept(box(tmp_path / "trough", sides=sides + ends))
    assert (inside.link, inside.reason, inside.joints) == ("body", "", ("hinge",))


ARM = shape("0.26 0.2 0.005", "collision", "0.15 0 -0.09") + shape("0.005 0.2 0.1", "collision", "0.02 0 -0.045")
"""A plate that lies under the contents and goes up with the lid."""
PLANTED = {
    "no floor": (tray(floor="visual"), "falls through at rest"),
    "filled": (tray(walls="visual", floor="visual") + shape("0.3 0.24 0.1", "collision", "0 0 0.05"), "leave no place"),
    "no front": (tray(walls="visual"), "out on opening"),
}


@pytest.mark.parametrize("name", PLANTED)
def test_a_drawer_without_what_it_shows_is_found(name: str, tmp_path: Path) -> None:
    inside, said = PLANTED[name]
    (drawer,) = [item for item in kept(chest(tmp_path / "chest", inside)) if item.link == "drawer"]
    assert said in drawer.reason and not drawer.shut, drawer
    assert drawer.free < 0.1 if name == "filled" else drawer.free == 1.0


def test_a_lid_that_throws_what_lies_below_and_one_that_is_stuck_are_told_apart(tmp_path: Path) -> None:
    (thrown,) = kept(box(tmp_path / "thrower", ARM))
    assert "out on opening" in thrown.reason or "jammed" in thrown.reason
    (stuck,) = [item for item in kept(chest(tmp_path / "stuck", tray(), friction=400.0)) if item.link == "drawer"]
    assert stuck.shut and "when empty either" in stuck.reason


def test_it_warns_with_columns_and_decides_nothing(tmp_path: Path) -> None:
    job = AssetJob(AssetRef(asset_id="thing", path="thing"), Path("out"), Settings(checks=("contents",)), prior)
    bad = measure_contents(job, chest(tmp_path / "bad", PLANTED["no floor"][0]))
    (finding,) = [item for item in bad.findings if item.link == "drawer"]
    assert finding.code == "contents_leave" and bad.further["contents_free"] == 1.0
    assert float(bad.further["contents"] or 0.0) < 1.0 and "drawer: the" in str(bad.further["contents_reason"])
    assert measure_contents(job, None).further == {}
    record: TypeAdapter[Any] = TypeAdapter(AssetRecord.__annotations__["further"])
    read = record.validate_json(record.dump_json(record.validate_python(dict(bad.further))))
    assert type(read["contents_interiors"]) is int, "a count that comes back as 1.0 is refused by the tables"
    solid = robot(link("body", shape("0.3 0.3 0.3", xyz="0 0 0.15") + inertial(20.0, 0.3)))
    none = contents_columns(refined(tmp_path / "solid", solid, [], {"body": 20.0})).further
    assert none["contents"] is None and (none["contents_interiors"], none["contents_room_l"]) == (0, 0.0)


def test_a_drawers_inside_is_no_room_of_its_body(tmp_path: Path) -> None:
    """A drawer that comes out by a third: of its inside, which the body's walls surround too, no part is the body's."""
    shell = shape("0.34 0.3 0.01", xyz="0 0 0.005") + shape("0.34 0.3 0.01", xyz="0 0 0.155")
    shell += shape("0.01 0.3 0.16", xyz="-0.165 0 0.08")
    shell += "".join(shape("0.34 0.01 0.16", xyz=f"0 {y} 0.08") for y in (-0.145, 0.145))
    parts = {"drawer": (Solid(tray(), 0.8, 0.2), "prismatic", "0 0 0.014", "1 0 0", 0.1)}
    found = kept(things(tmp_path / "chest", Solid(shell, 8.0, 0.3), parts))
    assert [(item.link, item.reason) for item in found] == [("drawer", "")]


def test_nothing_lies_in_what_is_drawn_solid(tmp_path: Path) -> None:
    """Drawers drawn as boxes in a box: between them is no room, though faces of all are around it."""
    block = Solid(shape("0.3 0.3 0.5"), 5.0, 0.3)
    parts = {
        name: (Solid(shape("0.3 0.25 0.15"), 0.5, 0.2), "prismatic", f"0.001 0 {z}", "1 0 0", 0.2)
        for name, z in (("upper", 0.12), ("lower", -0.12))
    }
    assert kept(things(tmp_path / "block", block, parts)) == []


def test_a_lid_on_a_short_way_is_lifted_with_its_weight(tmp_path: Path) -> None:
    """A pot's lid that comes up by 12 mm, and a tray by 3 mm: the hand bears it, and what lies on it."""
    lid = Solid(shape("0.3 0.24 0.005") + shape("0.03 0.03 0.02", xyz="0 0 0.01"), 1.5, 0.2)
    folder = two(tmp_path / "pot", Solid(tray(), 1.0, 0.2), lid, "prismatic", "0 0 0.106", "0 0 1", 0.012,
                 names=("lid", "slide"), friction=0.2, damping=1.0, holds=False, effective_inertia=1.5)  # fmt: skip
    (inside,) = kept(folder)
    assert (inside.reason, inside.shut, inside.joints) == ("", False, ("slide",))
    foot = Solid(shape("0.2 0.2 0.02", xyz="0 0 0.01"), 3.0, 0.2)
    raised = two(tmp_path / "tray", foot, Solid(tray(), 0.2, 0.2), "prismatic", "0 0 0.03", "0 0 1", 0.003,
                 names=("tray", "slide"), friction=0.1, damping=0.5, holds=False, effective_inertia=0.2)  # fmt: skip
    (inside,) = kept(raised)
    assert (inside.link, inside.reason, inside.shut, inside.joints) == ("tray", "", False, ("slide",))


def test_the_root_may_be_called_world_as_some_files_have_it(tmp_path: Path) -> None:
    """MuJoCo takes a link "world" for its own world, and what hangs on it stands for it."""
    folder = box(tmp_path / "box")
    written = (folder / "mobility.urdf").read_text()
    held = '<link name="world"/><joint name="held" type="fixed"><parent link="world"/><child link="body"/></joint>'
    (folder / "mobility.urdf").write_text(written.replace("<link", held + "<link", 1))
    (inside,) = kept(folder)
    assert (inside.link, inside.reason) == ("body", "")


@pytest.mark.parametrize("rail", ["visual collision", "visual", ""])
def test_what_stands_on_a_doors_shelf_stays_behind_its_rail(rail: str, tmp_path: Path) -> None:
    """A door that turns about the vertical carries a shelf, from which things slide where its rail does not collide;
    a ledge without a rail is none."""
    shell = shape("0.4 0.5 0.01", xyz="0 0 0.005") + shape("0.4 0.5 0.01", xyz="0 0 0.795")
    shell += shape("0.01 0.5 0.8", xyz="-0.195 0 0.4")
    shell += "".join(shape("0.4 0.01 0.8", xyz=f"0 {y} 0.4") for y in (-0.245, 0.245))
    shelf = shape("0.02 0.48 0.76", xyz="0.01 0.24 0.38") + shape("0.1 0.4 0.005", xyz="-0.05 0.24 0.3")
    shelf += "".join(shape("0.1 0.005 0.08", xyz=f"-0.05 {y} 0.34") for y in (0.04, 0.44))
    shelf += shape("0.005 0.4 0.08", rail, "-0.1 0.24 0.34") if rail else ""
    parts = {"door": (Solid(shelf, 4.0, 0.5), "revolute", "0.205 -0.24 0.02", "0 0 -1", 1.7)}
    found = {item.link: item for item in kept(things(tmp_path / "fridge", Solid(shell, 20.0, 0.6), parts))}
    assert found["body"].reason == "" and ("door" in found) == bool(rail)
    if rail:
        assert found["door"].joints == ("door_joint",)
        assert bool(found["door"].reason) == (rail == "visual"), found["door"]
