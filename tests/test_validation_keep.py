"""What a file says and is plausible stays: sizes in metres, weighed masses. Words of the user go first."""

import re
from pathlib import Path

import pytest
import trimesh

from asset2sim.assets.extract import Extraction
from asset2sim.assets.metric import STATED_UNIT
from asset2sim.catalog.rows import GUESSES
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.read import read_guidance
from asset2sim.intake.origin import extract
from asset2sim.validation.size import with_sensible_size
from asset2sim.validation.validate import validate
from schemas.asset import AssetRef
from schemas.authored import MASSES_FIT, UNLIKE_UNITS
from schemas.finding import Finding, Notes
from schemas.inputs import InputSettings
from schemas.overlay import LinkProposal, Overlay, PhysicsOverlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source
from tests.assets import box_obj, joint, link, mesh, read, robot, shape, written
from tests.cabinets import written_cabinet
from tests.prior_objects import ask, hinged, thing

WEIGHED = (
    '<inertial><origin xyz="0.01 0 0"/><mass value="{mass}"/>'
    '<inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/></inertial>'
)


def box_with_lid(folder: Path, *masses: float, moment: float = 0.02, size: float = 0.4) -> Extraction:
    """A cube and a lid, weighed where ``masses`` (kg) are given."""
    said = [WEIGHED.format(mass=mass, i=moment * mass) for mass in masses] or ["", ""]
    parts = [
        link(name, text + shape(" ".join([f"{size}"] * 3))) for name, text in zip(("box", "lid"), said, strict=True)
    ]
    hinge = joint("hinge", "revolute", "box", "lid", xyz=f"0 0 {size}", axis="1 0 0", limit="0 1.5")
    return read(written(folder, robot(*parts, hinge)))


def complete(item: Extraction, overlay: Overlay) -> tuple[PhysicsOverlay, dict[str, Finding]]:
    done, findings = validate(item, overlay, Source.MODEL, 0.5, PhysicsSettings())
    return done, {finding.code: finding for finding in findings}


@pytest.mark.system  # reading MJCF loads MuJoCo, which starts a program
@pytest.mark.parametrize("kind", ["sdf", "mjcf", "xacro", "urdf"])
def test_formats_of_simulators_have_metres_and_so_has_a_urdf_of_drawn_boxes(kind: str, tmp_path: Path) -> None:
    folder = written_cabinet(tmp_path / "one", kind)
    said = read(folder).features.metric
    assert re.fullmatch(rf"lengths of {kind} are metres|its boxes and cylinders are drawn in .* millimetre", said, re.I)
    assert said.startswith("its boxes") == (kind == "urdf")
    ref = AssetRef(asset_id="one", category="", path=str(folder))
    assert extract(ref, inputs=InputSettings(keep=("nothing",))).features.metric == ""


def test_masses_that_fit_their_volumes_speak_for_metres(tmp_path: Path) -> None:
    assert box_with_lid(tmp_path / "a", 3.0, 1.5).features.metric == "its masses fit its volumes in metres"
    assert box_with_lid(tmp_path / "b").features.metric == UNLIKE_UNITS, "nothing is stated"
    assert box_with_lid(tmp_path / "c", 1.0, 1.0, moment=1.0).features.metric == UNLIKE_UNITS, "placeholders"
    assert box_with_lid(tmp_path / "d", 3.0, 1.5, size=4.0).features.metric == "", "a normalised mesh"


LIGHT = Overlay(
    scale=1.0,
    links=tuple(LinkProposal(name=n, density_kg_m3=300.0) for n in ("body", "door", "part_0", "part_1", "part_2")),
)
BOXES = ("0.6 0.58 0.72", "0.018 0.56 0.684", "0.9144 0.02 0.1", "0.6 0.41999999999999993 0.3")


@pytest.mark.parametrize(
    ("boxes", "metric"),
    [
        (BOXES, True),
        ([box.replace("0.72", "0.7213457") for box in BOXES] + ["0.123456 0.234567 0.345678"], False),
        (("1.4 1.2 0.1", "0.05 1.2 0.4", "1.5 1.3 0.1"), True),
        (("0.5 0.2 0.4", "0.3 0.1 0.6", "0.8 0.7 0.9"), False),
        ((*BOXES, "1 0.02 0.02"), True),
        ((*BOXES, "1 0.02 0.02", "mesh"), False),
        ((*BOXES, "1.1 0.02 0.02", "mesh"), True),
        (("0.6 0.58 0.72",), False),
    ],
    ids=["drawn", "measured", "round", "in tenths alone", "of 1", "brought to 1", "beside a mesh", "one box"],
)
def test_boxes_drawn_with_a_ruler_speak_for_metres(boxes: list[str], metric: bool, tmp_path: Path) -> None:
    shapes = [mesh("a.obj") if box == "mesh" else shape(box) for box in boxes]
    parts = [link(f"part_{number}", drawn) for number, drawn in enumerate(shapes)]
    fixed = [joint(f"joint_{number}", "fixed", "part_0", f"part_{number}") for number in range(1, len(boxes))]
    place = written(tmp_path, robot(*parts, *fixed))
    (place / "a.obj").write_text(box_obj((0.0, 0.0, 0.0), (0.1, 0.2, 0.3)))
    said = read(place).features.metric
    assert (said == "its boxes and cylinders are drawn in tenths of a millimetre") is metric


def test_a_size_in_metres_stays_unless_words_ask_otherwise() -> None:
    def final(words: str, size: float, lengths: str) -> tuple[float, float]:
        told = {**thing("Microwave", hinged("door", "door"), size=size), **({"lengths": lengths} if lengths else {})}
        info = ObjectInfo.from_json(told)
        proposed = ask(told, words)["scale"]
        moved = with_sensible_size(info, read_guidance(words, info), Overlay(scale=0.4), Notes()).scale
        return proposed, moved

    assert final("", 0.9, "lengths of MJCF are metres") == pytest.approx((1.0, 1.0))
    assert final("A microwave whose door is open.", 0.2, "lengths of SDF are metres")[0] == 1.0
    assert final("", 0.9, "")[0] != 1.0 and final("", 0.9, "")[1] < 0.5
    small, moved = final("A small microwave.", 0.9, "lengths of MJCF are metres")
    assert small < 0.5 and moved < 0.5
    assert final("", 30.0, "lengths of MJCF are metres")[0] < 0.1, "no microwave is so large"
    assert final("", 30.0, f"lengths of MJCF are metres, and {MASSES_FIT}")[0] == 1.0, (
        "it would weigh 27,000 times less"
    )


@pytest.mark.parametrize(("size", "said"), [(0.97, True), (0.5, False)])
def test_a_kept_size_that_is_none_of_its_kind_is_said(size: float, said: bool) -> None:
    info = ObjectInfo.from_json({**thing("Microwave", size=size), "lengths": "lengths of MJCF are metres"})
    notes = Notes()
    assert with_sensible_size(info, read_guidance("", info), Overlay(scale=1.0), notes).scale == 1.0
    assert [item.code for item in notes.findings] == ["size_unusual"] * said


def test_a_kind_that_is_only_read_from_names_changes_no_size_in_metres() -> None:
    told = {**thing("", asset_id="bottle_cap", size=0.03), "lengths": "lengths of SDF are metres"}
    info = ObjectInfo.from_json(told)
    guidance = read_guidance("", info)
    assert guidance.category == "Bottle" and ask(told, "")["scale"] == 1.0, "a cap of a bottle is no bottle of 3 cm"
    assert with_sensible_size(info, guidance, Overlay(scale=1.0), Notes()).scale == 1.0
    handle = {**thing("", asset_id="door_handle", size=0.22), "lengths": told["lengths"]}
    assert read_guidance("", ObjectInfo.from_json(handle)).category == "DoorHandle", "it has a row of its own"
    stated = ObjectInfo.from_json({**handle, "category": "Door"})
    assert with_sensible_size(stated, read_guidance("", stated), Overlay(scale=1.0), Notes()).scale > 5.0


def test_plausible_masses_stay_and_others_are_supplied(tmp_path: Path) -> None:
    light = Overlay(scale=1.0, links=tuple(LinkProposal(name=name, density_kg_m3=20.0) for name in ("box", "lid")))
    done, findings = complete(box_with_lid(tmp_path / "a", 3.0, 1.5), light)
    assert [item.mass_kg for item in done.links] == [3.0, 1.5]
    assert {item.mass_source for item in done.links} == {Source.AUTHORED} and "rescaled" not in findings
    assert done.links[0].com == (0.01, 0.0, 0.0) and done.links[0].inertia[0] == pytest.approx(0.06)
    users = light.model_copy(
        update={"links": (LinkProposal(name="box", mass_kg=9.0), light.links[1]), "asked": ("links.box.mass_kg",)}
    )
    done, _ = complete(box_with_lid(tmp_path / "b", 3.0, 1.5), users)
    assert [(item.mass_kg, item.mass_source) for item in done.links] == [(9.0, Source.USER), (1.5, Source.AUTHORED)]
    for other, masses in (("c", (1.0, 1.0)), ("d", ())):
        done, _ = complete(box_with_lid(tmp_path / other, *masses, moment=1.0), light)
        assert {item.mass_source for item in done.links} == {Source.MODEL}, "placeholders, and nothing"


@pytest.mark.parametrize(
    ("second", "tie", "kept"),
    [("0.5 0.02 0.6", "", True), ("0.5 0.02 0.2", "", False), ("0.5 0.02 0.2", '<mimic joint="hinge_1"/>', True)],
    ids=["alike", "larger", "follows"],
)
def test_parts_of_which_one_is_larger_do_not_weigh_the_same(second: str, tie: str, kept: bool, tmp_path: Path) -> None:
    """Two doors have the same mass and inertia, the body has its own: of doors of another size nobody weighed them."""
    said = [WEIGHED.format(mass=mass, i=1.0) for mass in (20.0, 2.0, 2.0)]
    shapes = [shape(size) for size in ("0.5 0.4 0.6", "0.5 0.02 0.6", second)]
    parts = [link(f"part_{number}", text + form) for number, (text, form) in enumerate(zip(said, shapes, strict=True))]
    hinges = [joint(f"hinge_{n}", "revolute", "part_0", f"part_{n}", xyz="0 0.2 0", axis="0 0 1", limit="0 1.5",
                    more=more) for n, more in ((1, ""), (2, tie))]  # fmt: skip
    done, _ = complete(read(written(tmp_path, robot(*parts, *hinges))), LIGHT)
    assert {item.mass_source is Source.AUTHORED for item in done.links[1:]} == {kept}


@pytest.mark.parametrize(("thickness", "mass", "kept"), [(0.02, 0.1, False), (0.02, 4.0, True), (0.4, 1.5, True)])
def test_a_plate_lighter_than_foam_is_not_believed(thickness: float, mass: float, kept: bool, tmp_path: Path) -> None:
    """A door of 0.5 m by 0.6 m: 0.1 kg are 17 kg/m³, 4 kg 667 kg/m³; as thick as a cabinet it stands for a hollow."""
    parts = [
        link("body", WEIGHED.format(mass=20.0, i=1.0) + shape("0.5 0.4 0.6")),
        link("door", WEIGHED.format(mass=mass, i=mass * 0.02) + shape(f"0.5 {thickness} 0.6")),
    ]
    hinge = joint("hinge", "revolute", "body", "door", xyz="0 0.2 0", axis="0 0 1", limit="0 1.5")
    done, _ = complete(read(written(tmp_path, robot(*parts, hinge))), LIGHT)
    assert (done.links[1].mass_source is Source.AUTHORED) is kept


@pytest.mark.parametrize(
    ("name", "mass", "kept"),
    [("door", 0.1, False), ("door", 0.8, True), ("panel", 0.1, True), ("door_handle", 0.1, True)],
)
def test_a_door_of_a_tenth_of_what_it_is_built_of_was_not_weighed(
    name: str, mass: float, kept: bool, tmp_path: Path
) -> None:
    """A door of 0.5 m by 0.6 m of two boards, 3.3 kg as built: its hull of 40 mm has 8 kg/m³ at 0.1 kg."""
    parts = [
        link("body", WEIGHED.format(mass=20.0, i=1.0) + shape("0.5 0.4 0.6")),
        link(name, WEIGHED.format(mass=mass, i=mass * 0.02) + shape("0.5 0.04 0.6")),
    ]
    hinge = joint("hinge", "revolute", "body", name, xyz="0 0.2 0", axis="0 0 1", limit="0 1.5")
    board = LinkProposal(name=name, material="particleboard", density_kg_m3=680.0, wall_m=0.008)
    done, _ = complete(read(written(tmp_path, robot(*parts, hinge))), Overlay(scale=1.0, links=(board,)))
    assert (done.links[1].mass_source is Source.AUTHORED) is kept


@pytest.mark.parametrize(
    ("source", "name", "masses", "kept"),
    [
        (Source.PRIOR, "cabinet", (1.5, 0.5), False),
        (Source.PRIOR, "cabinet", (3.0, 0.8), True),
        (Source.PRIOR, "zq", (1.5, 0.5), True),
        (Source.PRIOR, "zq", (0.65, 0.1), False),
        (Source.MODEL, "cabinet", (1.5, 0.5), True),
    ],
)
def test_masses_far_below_what_such_parts_weigh_together_were_not_weighed(
    source: Source, name: str, masses: tuple[float, float], kept: bool, tmp_path: Path
) -> None:
    """Body and panel are 20 kg as built, and none by itself is too light."""
    parts = [
        link("body", WEIGHED.format(mass=masses[0], i=masses[0] * 0.05) + shape("0.5 0.4 0.6")),
        link("panel", WEIGHED.format(mass=masses[1], i=masses[1] * 0.03) + shape("0.5 0.04 0.6")),
        link("knob", WEIGHED.format(mass=0.01, i=0.000004) + shape("0.05 0.05 0.05")),
    ]
    hinges = [joint(f"hinge_{n}", "revolute", "body", n, xyz="0 0.2 0", axis="0 0 1", limit="0 1.5")
              for n in ("panel", "knob")]  # fmt: skip
    item = read(written(tmp_path, robot(*parts, *hinges)))
    boards = tuple(
        LinkProposal(name=n, material="particleboard", density_kg_m3=680.0, wall_m=w)
        for n, w in (("body", 0.016), ("panel", 0.008), ("knob", 0.02))
    )
    guidance = read_guidance("", ObjectInfo.from_json(thing("", asset_id=name, size=0.6)))
    done, _ = validate(item, Overlay(scale=1.0, links=boards), source, 0.5, PhysicsSettings(), guidance=guidance)
    assert [link.mass_source is Source.AUTHORED for link in done.links] == [kept, kept, True], "a knob may be light"


@pytest.mark.parametrize(("offset", "metric"), [("0.1575", True), ("0.1575331", False)])
def test_where_few_drawn_shapes_stand_speaks_for_metres_too(offset: str, metric: bool, tmp_path: Path) -> None:
    """A plate of two lengths on a mesh's hinge: four lengths with the offsets of its shape and its hinge."""
    parts = [link("body", mesh("body.obj")), link("lever", shape("0.03 0.015 0.03", xyz=f"0 0 {offset}"))]
    hinge = joint("hinge", "revolute", "body", "lever", xyz="0.06 0 0", axis="0 1 0", limit="-0.7 0.7")
    place = written(tmp_path, robot(*parts, hinge))
    (place / "body.obj").write_text(box_obj((0.0, 0.0, 0.0), (0.12, 0.315, 0.5)))
    assert (read(place).features.metric != UNLIKE_UNITS) is metric


@pytest.mark.parametrize(
    ("scale", "asked", "code"),
    [
        (0.5, (), "rescaled_unasked"),
        (5.0, (), "rescaled_unasked"),
        (0.5, ("scale",), "rescaled"),
        (1.2, (), "rescaled"),
    ],
)
def test_another_size_of_an_object_in_metres_is_a_finding_and_doubtful_if_nobody_asked(
    scale: float, asked: tuple[str, ...], code: str, tmp_path: Path
) -> None:
    done, findings = complete(box_with_lid(tmp_path / "a", 3.0, 1.5), Overlay(scale=scale, asked=asked))
    assert findings[code].value == done.scale == scale and "fit its volumes" in findings[code].message
    assert (code in GUESSES) == (code == "rescaled_unasked")


def test_a_hall_in_metres_is_larger_than_any_household_object(tmp_path: Path) -> None:
    weighed = box_with_lid(tmp_path / "a", 30_000.0, 15_000.0, moment=2.0, size=6.0)
    done, findings = complete(weighed, Overlay(scale=1.0))
    assert done.scale == 1.0 and "scale_bounded" not in findings
    assert complete(box_with_lid(tmp_path / "b", size=6.0), Overlay(scale=1.0))[0].scale < 1.0


@pytest.mark.parametrize(("unit", "high", "metric"), [(True, 0.9, True), (False, 0.9, False), (True, 1.8, False)])
def test_meshes_that_state_their_unit_speak_for_metres(unit: bool, high: float, metric: bool, tmp_path: Path) -> None:
    """A cart 1.8 m long, of a size to which datasets bring objects; one whose longest edges are 2 was brought to it."""
    box = trimesh.creation.box((2.0 if high == 1.8 else 1.8, 1.0, high))
    place = written(tmp_path, robot(link("body", mesh("body.dae"))))
    text = trimesh.exchange.dae.export_collada(box).decode()
    (place / "body.dae").write_text(text.replace("<asset>", '<asset><unit name="meter" meter="1"/>') if unit else text)
    assert (read(place).features.metric == STATED_UNIT) is metric
