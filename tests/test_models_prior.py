"""The offline model's tables and answers: any text is answered, sizes and masses are those of real things."""

import csv
import json
import math
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asset2sim.guidance import tables
from asset2sim.guidance.edges import fitted_edges
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.models.prior.answer import answer
from asset2sim.models.prior.link_proposals import link_mass
from schemas.asset import AssetRef
from schemas.overlay import Overlay
from tests import prior_objects as known
from tests.marks import OBJECTS, needs_objects
from tests.prior_objects import Json, ask, felt, hinged, joint, link, prompt, thing

PARTNET_MOBILITY = [
    "Bottle", "Box", "Bucket", "Camera", "Cart", "Chair", "Clock", "CoffeeMachine", "Dishwasher", "Dispenser",
    "Display", "Door", "Eyeglasses", "Fan", "Faucet", "FoldingChair", "Globe", "Kettle", "Keyboard", "KitchenPot",
    "Knife", "Lamp", "Laptop", "Lighter", "Microwave", "Mouse", "Oven", "Pen", "Phone", "Pliers", "Printer",
    "Refrigerator", "Remote", "Safe", "Scissors", "Stapler", "StorageFurniture", "Suitcase", "Switch", "Table",
    "Toaster", "Toilet", "TrashCan", "USB", "WashingMachine", "Window",
]  # fmt: skip


def total_mass(information: Json, overlay: Json) -> float:
    """kg, as validation works it out: of a wall or a solid, and what is inside."""
    links = ObjectInfo.from_json(information).link_by_name
    proposals = Overlay.model_validate_json(json.dumps(overlay)).links
    return sum(link_mass(links[item.name], item, overlay["scale"]) for item in proposals)


FLAT = thing("") | {"size_m": [0.24, 1.6, 1.6], "size_closed_m": [0.24, 1.6, 1.6]}
"""An object without a name, as thin as a wall clock."""


# Tables


def test_every_category_of_partnet_mobility_has_a_size() -> None:
    assert set(PARTNET_MOBILITY) <= set(tables.sizes())


def test_drawers_of_appliances_are_not_of_board() -> None:
    board = {name for name, material in tables.materials().items() if "board" in name} | {"wood"}
    for category in ("CoffeeMachine", "Dishwasher", "Oven", "Printer", "Refrigerator", "WashingMachine"):
        assert tables.part_material(category, "drawer").material not in board, category


def test_the_panel_of_a_display_is_in_its_screen() -> None:
    tilting = thing("Display", hinged("tilt", "rotation_screen"), body="display_base", size=0.55)
    inside = {item["name"]: [c["name"] for c in item.get("contents", ())] for item in ask(tilting)["links"]}
    assert inside == {"body": ["stand"], "tilt_link": ["panel and boards"]}


def test_a_monitor_starts_as_it_is_drawn() -> None:
    assert tables.mechanism("screen", "Display", "hinge").role == "control"
    assert tables.mechanism("screen", "Laptop", "hinge").role == "main"


def test_a_kind_that_its_edges_tell_is_built_as_its_category() -> None:
    for kind, category in (("WideRefrigerator", "Refrigerator"), ("CountertopDishwasher", "Dishwasher")):
        assert tables.part_material(kind, "door") is tables.part_material(category, "door"), kind
        assert tables.mechanism("door", kind, "hinge") is tables.mechanism("door", category, "hinge"), kind
        assert tables.part_effort("door", kind, "hinge") is tables.part_effort("door", category, "hinge"), kind
    assert tables.part_material("GrandfatherClock", "").material != tables.part_material("Clock", "").material, "wood"
    assert tables.part_contents("CountertopDishwasher", "") == tables.part_contents("Dishwasher", "") != ()
    assert tables.part_contents("FloorFan", "") != tables.part_contents("Fan", ""), "rows of its own"


def test_the_motor_of_a_fan_is_in_the_head_that_turns() -> None:
    head = hinged("turn", "fan_frame")
    for moving, holder in (((head,), "turn_link"), ((), "body")):
        links = ask(thing("Fan", *moving, body="fan_base", size=0.5))["links"]
        assert [item["name"] for item in links if "motor" in [c["name"] for c in item.get("contents", ())]] == [holder]


def test_a_lamp_on_arms_has_a_heavier_foot() -> None:
    weights = []
    for moving in ((), (hinged("arm", "rotation_bar"),)):
        drawn = thing("Lamp", *moving, body="lamp_base", size=0.45)
        for item in drawn["links"]:
            item |= {"outer_m2": 0.01, "area_m2": 0.01}
        weights.append(sum(item["mass_kg"] for item in ask(drawn)["links"][0]["contents"]))
    assert weights[1] == pytest.approx(2.0 * weights[0], rel=1e-3)


def test_a_wall_clock_hangs_and_a_longcase_clock_stands() -> None:
    for edges, support in (
        ((0.04, 0.3, 0.3), "fixed"),
        ((0.26, 0.45, 2.0), "freestanding"),
        ((0.06, 0.11, 0.13), "freestanding"),
    ):
        drawn = thing("Clock") | {key: list(edges) for key in ("size_closed_m", "size_m")}
        assert ask(drawn)["support"]["kind"] == support, edges


def test_a_knife_whose_blade_turns_is_a_pocket_knife() -> None:
    folding, sliding_ = hinged("b", "rotation_blade", upper=3.1), known.sliding("b", "translation_blade", upper=0.1)
    assert [ask(thing("Knife", part))["notes"][0].split(":")[0] for part in (folding, sliding_)] == [
        "category PocketKnife", "category Knife",
    ]  # fmt: skip


def test_doors_are_weighed_by_the_leaf() -> None:
    def most(leaves: int) -> float:
        parts = [hinged(f"d{i}", "rotation_door") for i in range(leaves)]
        asked = "a door of steel"
        (said,) = (note for note in ask(thing("Door", *parts), asked)["notes"] if note.startswith("mass:"))
        return float(said.split(" to ")[-1].split(" kg")[0])

    assert most(2) == pytest.approx(2.0 * most(1), rel=0.01)


def test_a_doors_leaf_weighs_the_same_whatever_walls_stand_about_it() -> None:
    def built(wall_m2: float) -> tuple[float, float]:
        leaf, hinge = hinged("leaf", "rotation_door")
        leaf |= {"box_m": [0.9, 0.04, 2.0], "hull_volume_m3": 0.072, "volume_m3": 0.072, "outer_m2": 3.8}
        asked = thing("Door", (leaf, hinge), size=2.05)
        asked["links"][0] |= {"hull_volume_m3": 0.1 * wall_m2, "volume_m3": 0.1 * wall_m2, "outer_m2": 2.0 * wall_m2}
        frame, door = ask(asked)["links"]
        return door["wall_m"], frame["wall_m"]

    assert built(8.0) == built(0.2), "walls of 8 m2 made it a third of its weight"


def test_half_a_phone_is_built_as_a_phone() -> None:
    whole = tables.part_material("Phone", "")
    for part in ("lid", "slider"):
        assert tables.part_material("Phone", part).material == whole.material, part


def test_every_row_states_its_source() -> None:
    folder = Path(tables.__file__).parent / "csv_tables"
    for path in sorted(folder.glob("*.csv")):
        for row in csv.DictReader(path.open(encoding="utf-8")):
            assert None not in row, f"{path.name}: a cell too many in {row}"
            assert row["source"], f"{path.name}: {row}"


def test_tables_refer_to_one_another() -> None:
    assert set(tables.nouns().values()) <= set(tables.sizes())
    assert set(tables.material_words().values()) <= set(tables.materials())
    assert {word.value for word in tables.words().values() if word.kind == "level"} <= set(tables.coast_times())
    assert all(tables.part_material(c, p).material in tables.materials() for c in tables.sizes() for p in ("", "door"))


def test_densities_are_within_the_papers_ranges() -> None:
    table = tables.materials()
    assert all(2700 <= table[name].density_kg_m3 <= 8500 for name in ("aluminium", "steel", "brass"))
    assert all(900 <= table[name].density_kg_m3 <= 1400 for name in ("plastic", "polypropylene", "pvc"))
    assert 1000 <= table["rubber"].density_kg_m3 <= 1500


# Size


@pytest.mark.parametrize(
    ("information", "guidance", "longest_m"),
    [
        (known.LAPTOP, "", 0.32),
        (known.BOX, "a small box", 0.27),
        (known.BOX, "a very small box", 0.198),
        (known.BOX, "a box with a small lid", 0.40),
        (known.BOX, "A box. Make it tiny.", 0.162),
        (known.BOX, "low damping, little friction", 0.40),
        (known.DRAWERS, "a small office drawer cabinet", 0.27),
        (known.SUITCASE, "a small purse or handbag", 0.2475),
        (known.TOILET, "a very small toilet for a baby", 0.198),
        # Furniture for a child is no toy; what is small already stays so.
        (known.TOILET, "a toilet for a child", 0.455),
        (known.BOX, "a compact box", 0.34),
        (thing("Pen", size=1.0), "a small pen", 0.105),
        (known.BOX, "a box 25 cm long with its lid 10 degrees open", 0.25),
        (known.BOX, "scale 0.5", 0.8),
        (thing("Fridge", size=1.0), "", 1.6),
        (thing("trash_can"), "", 0.6),
        (FLAT | {"asset_id": "casio-330-analog-clock"}, "", 0.30),
        (thing("unheard of"), "a plastic bottle with a cap", 0.10),
        (thing("", hinged("a", "door"), body="microwave_body"), "", 0.48),
        (thing("unheard of"), "", 0.30),
    ],
)  # fmt: skip
def test_scale(information: Json, guidance: str, longest_m: float) -> None:
    overlay = ask(information, guidance)
    assert overlay["scale"] * max(information["size_closed_m"]) == pytest.approx(longest_m, rel=1e-3)


def test_what_is_small_fits_on_a_table_as_its_file_has_it_too() -> None:
    flaps_up = known.BOX | {"size_m": [1.6, 1.6, 3.2]}
    overlay = ask(flaps_up, "a small box")
    assert overlay["scale"] * 3.2 == pytest.approx(0.27, rel=1e-3)


def test_a_size_in_metres_that_fits_the_words_stays() -> None:
    assert ask(thing("Box", size=0.3), "a small box")["scale"] == 1.0
    assert ask(thing("DrawerCabinet", size=0.45), "a small drawer cabinet")["scale"] == 1.0


@pytest.mark.parametrize(
    ("information", "guidance"),
    [
        (thing("Refrigerator", size=1.7), ""),
        (thing("Furniture", size=1.79, asset_id="3t-600-clean-locker"), "A piece of furniture at its real size."),
        (thing("Furniture", size=0.33, asset_id="casio-330-analog-clock"), "A piece of furniture at its real size."),
        (thing("Laptop", size=0.31), "I want a laptop."),
        (thing("Microwave", size=0.35), "a small microwave"),
    ],
)
def test_an_object_in_real_metres_keeps_its_scale(information: Json, guidance: str) -> None:
    assert ask(information, guidance)["scale"] == 1.0


def test_near_the_typical_size_is_not_real_where_no_such_thing_is_so_large() -> None:
    """A washing machine of 1.13 m is within 20 % of the typical one, and beyond any on sale."""
    assert ask(thing("WashingMachine", size=1.13))["scale"] * 1.13 == pytest.approx(0.95, rel=1e-3)
    assert ask(thing("WashingMachine", size=1.0))["scale"] == 1.0


@pytest.mark.parametrize("guidance", ["", "a small bottle", "a large plastic bottle"])
def test_a_wide_bottle_is_sized_by_its_width(guidance: str) -> None:
    jar = thing("Bottle", size=0.25)
    jar["size_closed_m"] = jar["size_m"] = [0.18, 0.18, 0.25]
    slim = json.loads(json.dumps(jar))
    slim["size_closed_m"] = slim["size_m"] = [0.07, 0.07, 0.25]
    factor = {"": 1.0, "a small bottle": 0.75, "a large plastic bottle": 1.3}[guidance]
    assert ask(jar, guidance)["scale"] * 0.18 == pytest.approx(0.10 * factor, rel=1e-3)
    assert ask(slim, guidance)["scale"] * 0.25 == pytest.approx(0.25 * factor, rel=1e-3)


def test_the_last_noun_of_a_name_says_what_it_is() -> None:
    notes = ask(thing("Furniture", size=1.79, asset_id="naiki-6door-closet"), "at its real size")["notes"]
    assert notes[0] == "category Wardrobe: from the asset's name"


def test_scale_is_asked_only_when_words_say_so() -> None:
    assert "scale" in ask(known.BOX, "a small box")["asked"]
    assert "scale" not in ask(known.BOX, "a box with a small lid")["asked"]


# Mass


@pytest.mark.parametrize(
    ("information", "low", "high"),
    [(known.LAPTOP, 1.0, 3.0), (known.MICROWAVE, 8.0, 15.0), (known.STAPLER, 0.1, 0.5), (known.SAFE, 25.0, 80.0)],
)
def test_masses_are_those_of_such_things(information: Json, low: float, high: float) -> None:
    assert low <= total_mass(information, ask(information)) <= 1.001 * high


@pytest.mark.parametrize(
    "category",
    sorted(
        c
        for c, s in tables.sizes().items()
        if not tables.is_built(c) and not s.across_max_m
        if fitted_edges((1.0, 1.0, 0.99), c) is None  # or a cube is one of another size, as a minibar
    ),
)
def test_what_no_row_says_how_it_is_built_weighs_no_less_than_the_middle_of_its_kind(category: str) -> None:
    size = tables.sizes()[category]
    information = thing(category, size=size.typical_m)
    information["links"] = [link("body", size=size.typical_m / 2.0)]
    middle = math.sqrt(size.mass_min_kg * size.mass_max_kg)
    found = total_mass(information, ask(information))
    assert 0.99 * middle <= found <= 1.01 * size.mass_max_kg


def test_the_casing_of_such_a_thing_is_of_what_it_stands_on_and_its_small_parts_keep_their_own_mass() -> None:
    assert tables.part_material("FuseBox", "door").material == "steel"
    assert tables.part_material("Vise", "").material == "steel"
    assert tables.part_material("StandMixer", "").material == "plastic"
    assert tables.part_material("Laptop", "screen").material == "plastic" and tables.is_built("Laptop")


def test_the_casing_of_a_thing_of_no_known_kind_is_heavier_the_deeper_it_is() -> None:
    by_area = {}
    for size in (0.06, 0.3, 0.6, 5.0):
        item = thing("", asset_id="zq", size=size) | {"lengths": "lengths of SDF are metres"}
        item["links"] = [link("body", size=size)]
        found = ask(item)
        by_area[size] = total_mass(item, found) / item["links"][0]["outer_m2"], found["links"][0]["material"]
    assert [material for _, material in by_area.values()] == ["plastic", "plastic", "steel", "steel"]
    weights = [weight for weight, _ in by_area.values()]
    assert weights == sorted(weights) and 3.0 < weights[0] < 6.0 < weights[2] and weights[3] == pytest.approx(15.0, 0.2)


def test_a_large_wheel_is_mostly_air() -> None:
    share = []
    for size in (0.1, 0.6):
        item = thing("", asset_id="zq", size=size) | {"lengths": "lengths of SDF are metres"}
        item["links"] = [link("body", "wheel", size=size)]
        share.append(ask(item)["links"][0]["hollow_factor"])
    assert share[1] == pytest.approx(share[0] / math.sqrt(6.0), rel=1e-3)


def test_a_paper_cutter_is_of_no_paper() -> None:
    found = ask(thing("", size=0.4), "A paper cutter for A4.")
    assert "paperboard" not in {item["material"] for item in found["links"]}
    assert "paperboard" in {item["material"] for item in ask(thing("Box", size=0.4), "A paper box.")["links"]}


def test_a_stated_mass_is_met() -> None:
    assert total_mass(known.MICROWAVE, ask(known.MICROWAVE, "a microwave of 12.5 kg")) == pytest.approx(12.5, rel=0.01)


def test_the_guidance_names_materials() -> None:
    made = {item["name"]: item["material"] for item in ask(known.BOX, "A steel box with a glass lid.")["links"]}
    assert made == {"body": "steel", "lid_link": "glass"}


def test_the_volume_of_a_solid_part_is_its_hulls_where_its_mesh_has_walls() -> None:
    solid = thing("Cart", body="wheel")
    walled = json.loads(json.dumps(solid))
    walled["links"][0]["volume_m3"] *= 0.75
    factor = [ask(item, "")["links"][0]["hollow_factor"] for item in (solid, walled)]
    assert factor[1] == pytest.approx(factor[0] / 0.75, rel=0.01)


def test_a_total_outside_its_range_is_brought_there_and_said() -> None:
    change = ask(thing("Bucket", body="bucket_body"), "a bucket of 3 kg")["mass_change"]
    assert change["asked"] and change["to_kg"] == pytest.approx(3.0, rel=1e-3) and change["from_kg"] < 1.0
    assert "mass_change" not in ask(known.LAPTOP)


def test_machines_hold_their_weights_where_they_have_them() -> None:
    machine = thing("WashingMachine", body="washing_machine_body", size=0.95)
    body = ask(machine)["links"][0]
    inside = {item["name"]: item for item in body["contents"]}
    assert body["wall_m"] == pytest.approx(0.7e-3) and inside["counterweights"]["mass_kg"] == pytest.approx(22.0)
    assert inside["counterweights"]["at"] == pytest.approx([0.4, 0.5, 0.5]), "in front, which is −x"


def test_a_dishwashers_rack_is_wire_and_then_not_inside_the_body() -> None:
    """The issue found a sliding rack of 40 kg in a machine of 55."""
    empty = thing("Dishwasher", size=0.85)
    racked = thing("Dishwasher", known.sliding("rack", "drawer"), size=0.85)
    names = [[item["name"] for item in ask(machine)["links"][0]["contents"]] for machine in (empty, racked)]
    assert "racks and cutlery basket" in names[0] and "racks and cutlery basket" not in names[1]
    info, overlay = ObjectInfo.from_json(racked), Overlay.model_validate_json(json.dumps(ask(racked)))
    assert 1.0 <= link_mass(info.link_by_name["rack_link"], overlay.links[1], overlay.scale) <= 5.0


def test_only_a_bin_with_a_pedal_has_a_weighted_base_and_a_bucket() -> None:
    """So that the foot does not tip it: 0.5 kg in all was tipped by 15 N at its pedal."""
    lid, pedal = hinged("lid", "lid"), hinged("pedal", "foot_pad")
    inside = [{item["name"] for item in ask(thing("TrashCan", *parts))["links"][0].get("contents", ())} for parts in
              ((lid,), (lid, pedal))]  # fmt: skip
    assert not inside[0] and inside[1] >= {"inner bucket", "base with its ring"}


def test_a_fan_stands_on_a_weighted_foot_though_its_head_is_larger() -> None:
    head = hinged("head", "fan_frame", (0.0, 0.0, 1.0))
    foot, frame = ask(thing("Fan", (link("head_link", "fan_frame", (0.0, 0.0, 1.0), 0.6), head[1]), size=0.4))["links"]
    assert [item["name"] for item in foot["contents"]] == ["weight in the foot"]
    assert [item["name"] for item in frame["contents"]] == ["motor"]


def test_a_link_without_geometry_is_left_out() -> None:
    information = json.loads(json.dumps(known.BOX))
    empty = {**link("base"), "volume_m3": 0.0, "hull_volume_m3": 0.0, "outer_m2": 0.0}
    information["links"].append(empty)
    assert "base" not in {item["name"] for item in ask(information)["links"]}


# Mechanisms


def test_keys_spring_and_doors_hold() -> None:
    assert felt(ask(known.KEYBOARD), "k0")["spring_hz"] > 0.0
    assert felt(ask(known.MICROWAVE), "door")["holds"] is True
    assert felt(ask(known.TRASHCAN), "wheel")["holds"] is False


def test_a_helper_link_is_named_after_what_hangs_from_it() -> None:
    bare = {**link("helper"), "volume_m3": 0.0, "hull_volume_m3": 0.0, "outer_m2": 0.0}
    information = thing("Kettle", (bare, known.joint("slide", "helper", "prismatic", upper=0.2)))
    information["links"].append(link("top", "lid"))
    information["joints"].append(known.joint("turn", "top", "continuous", parent="helper"))
    assert ask(information, "kettle with its lid halfway open")["initial_joint_positions"] == pytest.approx(
        {"slide": 0.1}
    )


# Refinement


def refine(phi_m: float, position: float, desired: float, tried: Sequence[Json] = (), **changes: float) -> Json:
    """The answer for one joint from 0 (closed) to 1 (open)."""
    focus = {"name": "door", "type": "revolute", "lower": 0.0, "upper": 1.0, "closed": 0.0, "open": 1.0, **changes}
    information = {
        "purpose": "refinement", "phi_m": phi_m, "pairs": [{"link_a": "a", "link_b": "b", "penetration_m": phi_m}],
        "focus_joints": [{**focus, "position": position, "desired": desired}], "tried": list(tried),
    }  # fmt: skip
    parsed: Json = json.loads(answer(prompt(information, "")))
    return parsed


def test_a_good_state_is_approved() -> None:
    assert refine(0.001, 0.3, 0.3) == {"state_ok": True, "approved": True, "deltas": {}}


def test_a_wrong_state_goes_back_by_a_quarter() -> None:
    found = refine(0.001, 0.9, 0.3)
    assert not found["state_ok"]
    assert found["deltas"]["door"] == pytest.approx(-0.25)


@pytest.mark.parametrize(("phi_m", "step"), [(0.05, 0.1), (0.015, 0.08), (0.005, 0.03)])
def test_an_overlap_opens_the_door_and_stays_in_the_state(phi_m: float, step: float) -> None:
    assert refine(phi_m, 0.3, 0.3)["deltas"]["door"] == pytest.approx(step)
    assert refine(phi_m, 0.3, 0.3, closed=1.0, open=0.0)["deltas"]["door"] == pytest.approx(-step)


def test_a_door_at_the_end_of_its_tolerance_goes_back() -> None:
    assert refine(0.05, 0.4, 0.3)["deltas"]["door"] == pytest.approx(-0.1)


def test_what_was_refused_turns_once() -> None:
    refused = [{"positions": {"door": 0.6}, "phi_m": 0.0}]
    assert refine(0.05, 0.3, 0.3, refused)["deltas"] == pytest.approx({"door": -0.1})
    assert refine(0.05, 0.3, 0.3, 2 * refused)["deltas"] == {}


def parted(tried: Sequence[Json] = (), **changes: object) -> Json:
    """The answer for a lid and a drawer that are 10 mm in each other, which either parts, and a knob that does not."""
    names = {"lid": (0.0, 1.0), "drawer": (0.0, 0.4), "knob": (0.0, 3.0)}
    focus = [
        {"name": name, "type": "revolute", "lower": low, "upper": high, "closed": low, "open": high, "position": 0.1,
         "desired": 0.1, "reach": [0.0, 0.3], **changes} for name, (low, high) in names.items()
    ]  # fmt: skip
    collision = {"link_a": "a", "link_b": "b", "depth_mm": 10.0, "parted_by": [
        {"joint": "lid", "change": 0.04, "toward": "open"}, {"joint": "drawer", "change": -0.08, "toward": "closed"},
    ]}  # fmt: skip
    information = {"purpose": "refinement", "phi_m": 0.04, "collisions": [collision], "focus_joints": focus}
    deltas: Json = json.loads(answer(prompt({**information, "tried": list(tried)}, "")))["deltas"]
    return deltas


def test_what_the_prompt_says_parts_them_is_done_and_after_refusals_in_another_way() -> None:
    refused = {"positions": {"lid": 0.146}, "phi_m": 0.05}
    assert parted() == pytest.approx({"lid": 0.046})
    assert parted([refused]) == pytest.approx({"lid": 0.046, "drawer": -0.092})
    assert parted(2 * [refused]) == pytest.approx({"lid": 0.023})
    assert parted(3 * [refused]) == pytest.approx({"lid": -0.046})
    assert parted(4 * [refused]) == {}
    assert parted([refused, {**refused, "accepted": True}]) == pytest.approx({"lid": 0.046}), "anew from there"


def test_no_way_leads_beyond_the_reach_and_what_leads_nowhere_is_left_out() -> None:
    assert parted(reach=[0.1, 0.12]) == pytest.approx({"lid": 0.02})
    assert parted([{"positions": {}, "phi_m": 0.1}], reach=[0.1, 0.12]) == {}, "no further way is left"
    assert parted(reach=[0.0, 0.1]) == pytest.approx({"drawer": -0.092})


def test_what_nobody_asked_for_is_never_in_the_wrong_state() -> None:
    assert refine(0.05, 0.9, 0.3, asked=False)["state_ok"] and not refine(0.05, 0.9, 0.3)["state_ok"]


# Anything at all

_SCRAPS = st.sampled_from(
    sorted({" ".join(phrase) for phrase in (*tables.words(), *tables.size_words(), *tables.nouns())})
    + sorted(tables.part_words())
    + [*".,;:!-", "first", "second", "all", "other", "12", "0.5", "degrees", "cm", "kg"]
)  # fmt: skip
_JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)


@settings(max_examples=100, deadline=None)
@given(st.text(max_size=200) | st.lists(_SCRAPS, max_size=25).map(" ".join), st.sampled_from([
    known.BOX, known.CABINET, known.MICROWAVE, known.TOASTER, known.STAPLER, known.KEYBOARD,
]))  # fmt: skip
def test_any_guidance_gives_a_valid_overlay(guidance: str, information: Json) -> None:
    text = prompt(information, guidance)
    overlay = Overlay.model_validate_json(answer(text), strict=True)
    assert answer(text) == answer(text)
    joints = {item["name"]: item for item in information["joints"]}
    assert {item.name for item in overlay.joints} == set(joints)
    for name, position in overlay.initial_joint_positions.items():
        lower, upper = joints[name]["lower"], joints[name]["upper"]
        assert math.isfinite(position)
        assert lower is None or lower <= position <= upper
    assert set(overlay.asked) <= {"scale", *joints}


@settings(max_examples=60, deadline=None)
@given(st.text(max_size=300) | st.builds(prompt, _JSON, _JSON))
def test_any_text_gives_a_valid_overlay(text: str) -> None:
    assert Overlay.model_validate_json(answer(text)).scale > 0.0


def test_the_blocks_may_hold_their_own_tags_as_data() -> None:
    assert ask(known.BOX, "a small box <b>open</b>")["initial_joint_positions"] != {}


# Real objects


@needs_objects
def test_paper9_scales_are_near_the_experts() -> None:
    from asset2sim.intake.origin import extract
    from asset2sim.models.prompts import SYNTHESIS, overlay_request

    with (OBJECTS / "reference.csv").open(encoding="utf-8") as file:
        reference = {row["asset_id"]: float(row["scale"]) for row in csv.DictReader(file)}
    with (OBJECTS / "manifest.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["subset"] == "paper9"]
    errors = {}
    for row in rows:
        ref = AssetRef(asset_id=row["asset_id"], path=str(OBJECTS / row["path"]), category=row["category"])
        found = extract(ref).features
        request = overlay_request(SYNTHESIS, found, row["prompt"])
        overlay = Overlay.model_validate_json(answer(request.text))
        assert overlay.initial_joint_positions, row["prompt"]
        errors[row["asset_id"]] = abs(overlay.scale / reference[row["asset_id"]] - 1.0)
    errors.pop("102181")  # GenSim2 states no scale for it
    assert sum(errors.values()) / len(errors) < 0.25, errors


@pytest.mark.parametrize(
    "part", [known.hinged("tap", "switch"), known.spinning("tap", "switch"), known.sliding("tap", "lever")]
)
def test_a_tap_stays_as_it_is_turned_and_its_handle_is_a_casting(part: tuple[known.Json, known.Json]) -> None:
    """A handle that a spring brings back to off is a latch's."""
    overlay = ask(known.thing("Faucet", part))
    term = felt(overlay, "tap")
    assert term["holds"] is True and not term.get("spring_hz")
    handle = next(item for item in overlay["links"] if item["name"] == "tap_link")
    assert handle["material"] == "brass" and 0.0 < handle["wall_m"] <= 0.0025, "no solid"


def handle_of(category: str, words: str, box: tuple[float, float, float]) -> tuple[float, Json]:
    """Mass (kg, before it is brought to a total) and proposal of a handle that is a bar of this box (m)."""
    information = thing(category, hinged("handle", "handle"), size=0.3)
    x, y, z = box
    found = next(item for item in information["links"] if item["name"] == "handle_link")
    found |= {"box_m": list(box), "outer_m2": 2 * (x * y + y * z + z * x), "volume_m3": x * y * z}
    found["hull_volume_m3"] = x * y * z
    made = ask(information, words)
    proposal = next(item for item in Overlay.model_validate_json(json.dumps(made)).links if item.name == "handle_link")
    link_of = ObjectInfo.from_json(information).link_by_name["handle_link"]
    return link_mass(link_of, proposal, made["scale"]), proposal.model_dump() | {"scale": made["scale"]}


def test_a_handle_of_metal_is_cast_or_of_bar_and_not_pressed_from_sheet() -> None:
    kilograms, built = handle_of("Box", "A steel box in its real size of 0.3 m.", (0.05, 0.02, 0.02))
    assert built["material"] == "steel" and 0.001 < built["wall_m"] <= 0.0025, "sheet has 0.75 mm"
    assert kilograms > 0.04, "5 cm of a bar of 2 cm with walls of 1 mm and more"


def test_what_four_fingers_close_on_weighs_as_much_as_wire_of_4_mm(monkeypatch: pytest.MonkeyPatch) -> None:
    usual, strip = tables.part_material, tables.PartMaterial("steel", 0.2, 0.0)
    monkeypatch.setattr(tables, "part_material", lambda c, part: strip if part == "handle" else usual(c, part))
    kilograms, built = handle_of("Suitcase", "A suitcase.", (0.2, 0.005, 0.005))
    wire = math.pi / 4 * 0.004**2 * 7850 * 0.2 * built["scale"]
    assert kilograms == pytest.approx(wire, rel=0.02), "a fifth of its volume would be 8 g at full size"


@pytest.mark.parametrize(("category", "material"), [("Bottle", "polypropylene"), ("WashingMachine", "steel")])
def test_the_cap_of_a_machine_is_a_lid(category: str, material: str) -> None:
    made = ask(thing(category, hinged("cap", "cap"), size=0.6))["links"]
    assert next(item["material"] for item in made if item["name"] == "cap_link") == material


@pytest.mark.parametrize(
    ("cover", "words", "material"),
    [
        ("dark grey (black_metal)", "", "steel"),
        ("light grey (BrushedStainlessSteel), 80 %", "", "stainless steel"),
        ("dark grey (black_metal), 40 %", "", "plastic"),
        ("dark grey (black_metal)", "A plastic thing.", "plastic"),
        ("light grey (anodized_aluminium)", "", "aluminium"),
        ("black (box_glass)", "", "plastic"),
    ],
)
def test_a_files_paint_names_what_most_of_a_link_is_made_of(cover: str, words: str, material: str) -> None:
    item = thing("Glasses" if "glass" in cover else "", asset_id="thing", size=0.4)
    item["links"][0]["materials"] = [cover]
    assert ask(item, words)["links"][0]["material"] == material


def test_a_paint_called_metal_or_wood_is_any_of_its_kind() -> None:
    door = thing("Door", size=2.0)
    door["links"][0]["materials"] = ["brown (oak)"]
    assert ask(door)["links"][0]["material"] == ask(thing("Door", size=2.0))["links"][0]["material"] != "wood"


def test_a_sinks_tap_is_of_brass_and_a_teapots_spout_of_what_the_pot_is() -> None:
    sink = {
        item["name"]: item["material"]
        for item in ask(thing("Sink", hinged("tap", "spout"), hinged("grip", "handle")))["links"]
    }
    assert sink == {"body": "ceramic", "tap_link": "brass", "grip_link": "brass"}
    assert {item["material"] for item in ask(thing("Teapot", hinged("tap", "spout"), size=0.2))["links"]} == {"ceramic"}


@pytest.mark.parametrize(("box_m", "material"), [([0.11, 0.11, 0.04], "aluminium"), ([0.04, 0.11, 0.11], "rubber")])
def test_a_wheel_that_lies_flat_is_turned_by_hand_though_nothing_is_below_it(box_m: list[float], material: str) -> None:
    upright = box_m[2] > box_m[0]
    turns = joint("spin", "wheel", "continuous", axis=(1.0, 0.0, 0.0) if upright else (0.0, 0.0, 1.0))
    alone = {**thing("", ({**link("wheel", "wheel"), "box_m": box_m}, turns)), "size_m": box_m, "size_closed_m": box_m}
    alone["links"] = alone["links"][1:]
    assert {item["name"]: item["material"] for item in ask(alone)["links"]} == {"wheel": material}
