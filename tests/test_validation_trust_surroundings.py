"""Starts, contacts and collision shapes that a file in metres states: read from each format, judged, kept, counted."""

import json
from pathlib import Path

import pytest

from asset2sim.assets.extract import Extraction
from asset2sim.assets.urdf.edit import refined_urdf
from asset2sim.catalog.summarize import kept_columns, kept_counts
from asset2sim.intake.origin import extract
from asset2sim.models.object_facts import object_facts
from asset2sim.report.object_page import kept_rows
from asset2sim.validation.validate import validate
from schemas.asset import AssetRef
from schemas.finding import Finding
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Quantity, Source, Trust
from tests.assets import box_obj, joint, link, mesh, robot, shape, written
from tests.test_validation_trust import inertial, of

PLAIN = Overlay(scale=1.0)


def done(item: Extraction, overlay: Overlay = PLAIN) -> tuple[PhysicsOverlay, list[Finding]]:
    made, findings = validate(item, overlay, Source.MODEL, overlay.contact_friction or 0.5, PhysicsSettings())
    return made, list(findings)


def trusts(overlay: PhysicsOverlay, quantity: Quantity) -> dict[str, Trust]:
    return {name: item.trust for item in overlay.authored if item.quantity is quantity for name in item.of}


def desk(folder: Path, start: str = "", body: str = "", drawer: str = "", keep: tuple[str, ...] | None = None,
         limit: str = "0 0.2", shapes: str = "") -> Extraction:  # fmt: skip
    """A desk of 20 kg with a drawer, what its file says of contacts, and where its slide starts."""
    size = (0.4, 0.5, 0.6)
    place = written(folder, robot(
        link("body", inertial(20.0, size) + shape("0.4 0.5 0.6") + body),
        link("drawer", inertial(1.5, (0.3, 0.4, 0.2)) + (shapes or shape("0.3 0.4 0.2")) + drawer),
        joint("slide", "prismatic", "body", "drawer", xyz="0.36 0 0.16", axis="1 0 0", limit=limit,
              more=f"<dynamics {start}/>"),
    ), {"convex.obj": box_obj((-0.15, -0.2, -0.1), (0.15, 0.2, 0.1)), "tray.obj": TRAY})  # fmt: skip
    return extract(AssetRef(asset_id=folder.name, path=str(place), keep=keep))


def contact(friction: float | None = None, restitution: float | None = None) -> str:
    stated = {"lateral_friction": friction, "restitution": restitution}
    said = "".join(f'<{key} value="{value}"/>' for key, value in stated.items() if value is not None)
    return f"<contact>{said}</contact>"


TRAY = "".join(f"v {x} {y} {z}\n" for x in (-0.15, 0.15) for y in (-0.2, 0.2) for z in (-0.1, 0.1)) + (
    "v -0.14 -0.19 0.1\nv -0.14 0.19 0.1\nv 0.14 -0.19 0.1\nv 0.14 0.19 0.1\n"
    "v -0.14 -0.19 -0.09\nv -0.14 0.19 -0.09\nv 0.14 -0.19 -0.09\nv 0.14 0.19 -0.09\n"
    "f 1 3 7 5\nf 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\n"
    "f 2 9 10 4\nf 4 10 12 8\nf 8 12 11 6\nf 6 11 9 2\n"
    "f 9 13 14 10\nf 10 14 16 12\nf 12 16 15 11\nf 11 15 13 9\nf 13 15 16 14\n"
)
"""A closed box that is open at its top: its hull fills what it holds."""


@pytest.mark.parametrize(
    ("start", "trust", "at", "source"),
    [
        ('start="0.12"', Trust.PLAUSIBLE, 0.12, Source.AUTHORED),
        ('start="0.5"', Trust.IMPOSSIBLE, 0.0, Source.RULE),
        ('start="0.12" spring_stiffness="40"', Trust.DOUBTFUL, 0.0, Source.RULE),
        ("", None, 0.0, Source.RULE),
    ],
)
def test_a_drawer_starts_where_its_file_has_it(
    start: str, trust: Trust | None, at: float, source: Source, tmp_path: Path
) -> None:
    item = desk(tmp_path / "a", start)
    overlay, _ = done(item)
    slide = of(overlay, "slide")
    assert trusts(overlay, Quantity.START).get("slide") is trust
    assert (slide.initial_position, slide.position_source) == (at, source)
    asked = PLAIN.model_copy(update={"initial_joint_positions": {"slide": 0.05}, "asked": ("slide",)})
    assert of(done(item, asked)[0], "slide").initial_position == 0.05, "the user's words go first"


def test_starts_go_by_the_words_of_keep_and_are_told_to_a_model(tmp_path: Path) -> None:
    stated = 'start="0.12"'
    assert of(done(desk(tmp_path / "a", stated, keep=("nothing",)))[0], "slide").initial_position == 0.0
    assert of(done(desk(tmp_path / "b", stated, keep=("mass",)))[0], "slide").initial_position == 0.0
    assert of(done(desk(tmp_path / "c", stated, keep=("start",)))[0], "slide").initial_position == 0.12
    facts = object_facts(desk(tmp_path / "d", stated, drawer=contact(0.3)).features)
    assert facts["joints"][0]["file_states"] == {"start": 0.12}  # type: ignore[index]
    assert facts["links"][1]["file_states"] == {"contact": 0.3}  # type: ignore[index]


def test_a_coefficient_of_contacts_stays_where_surfaces_have_it(tmp_path: Path) -> None:
    item = desk(tmp_path / "a", body=contact(0.3), drawer=contact(0.3))
    overlay, _ = done(item)
    assert (overlay.contact_friction, overlay.contact_source) == (0.3, Source.AUTHORED)
    counts = kept_counts(overlay)
    assert (counts[Quantity.CONTACT, "kept"], counts[Quantity.START, "supplied"]) == (1, 1)
    stated = PLAIN.model_copy(update={"contact_friction": 0.7})
    assert done(item, stated)[0].contact_source is Source.USER and done(item, stated)[0].contact_friction == 0.7
    glued, _ = done(desk(tmp_path / "b", body=contact(100.0)))
    assert (glued.contact_friction, glued.contact_source) == (0.5, Source.MODEL)
    assert (
        trusts(glued, Quantity.CONTACT) == {"body": Trust.DOUBTFUL}
        and kept_counts(glued)[Quantity.CONTACT, "mended"] == 1
    )
    named = done(desk(tmp_path / "c", body=contact(100.0), keep=("contact",)))[0]
    assert (named.contact_friction, named.contact_source) == (100.0, Source.AUTHORED)
    assert trusts(done(desk(tmp_path / "d", body=contact(-1.0)))[0], Quantity.CONTACT) == {"body": Trust.IMPOSSIBLE}
    parts, _ = done(desk(tmp_path / "e", body=contact(0.3), drawer=contact(0.5)))
    assert (parts.contact_friction, parts.contact_source) == (0.4, Source.RULE)
    assert set(trusts(parts, Quantity.CONTACT).values()) == {Trust.DOUBTFUL}
    bouncy, _ = done(desk(tmp_path / "f", drawer=contact(None, 0.6)))
    assert trusts(bouncy, Quantity.CONTACT) == {"drawer": Trust.DOUBTFUL}


def test_a_refined_urdf_states_the_objects_coefficient_alone(tmp_path: Path) -> None:
    item = desk(tmp_path / "a", 'start="0.1"', body=contact(100.0, 0.9))
    overlay, _ = done(item)
    text = refined_urdf(item.urdf, item.features, overlay, {}, {}, PhysicsSettings()).decode()
    assert '<lateral_friction value="0.5"/>' in text and "restitution" not in text and "start=" not in text


@pytest.mark.parametrize(
    ("shapes", "trust", "source"),
    [
        (shape("0.3 0.4 0.2"), Trust.PLAUSIBLE, Source.AUTHORED),
        (mesh("convex.obj"), Trust.PLAUSIBLE, Source.AUTHORED),
        (mesh("tray.obj"), Trust.DOUBTFUL, Source.RULE),
        (shape("0.3 0.4 0.2", "visual") + mesh("convex.obj", "collision").replace(".obj", '.obj" scale="3 3 3'),
         Trust.DOUBTFUL, Source.RULE),
        (shape("0.3 0.4 0.2", "visual"), None, Source.RULE),
    ],
)  # fmt: skip
def test_collision_shapes_stay_where_they_are_convex_and_where_one_sees_the_part(
    shapes: str, trust: Trust | None, source: Source, tmp_path: Path
) -> None:
    overlay, _ = done(desk(tmp_path / "a", shapes=shapes))
    drawer = next(own for own in overlay.links if own.name == "drawer")
    assert trusts(overlay, Quantity.SHAPES).get("drawer") is trust and drawer.shapes_source is source
    rows = {quantity: how for quantity, how, _ in kept_rows(kept_columns(overlay))}
    assert rows["shapes"] == (
        "2 kept" if source is Source.AUTHORED else f"1 kept, 1 {'mended' if trust else 'supplied'}"
    )
    named = next(
        own for own in done(desk(tmp_path / "b", shapes=shapes, keep=("shapes",)))[0].links if own.name == "drawer"
    )
    assert named.shapes_source is (Source.AUTHORED if trust else Source.RULE)


MJCF = """<mujoco><worldbody><body name="box">
  <geom type="box" size=".2 .25 .3" mass="20" friction="0.4 .005 .0001"/>
  <body name="lid" pos="0 0 .3"><joint name="hinge" axis="0 1 0" range="0 90"/>
    <geom type="box" size=".2 .25 .01" pos="0 0 .01" mass="2" friction="0.4 .005 .0001"/></body>
</body></worldbody><keyframe><key name="other" qpos="0.2"/><key name="home" qpos="0.7"/></keyframe></mujoco>"""
SDF = """<sdf version="1.5"><model name="box">
<link name="box">
  <inertial><mass>20</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>
  <collision name="c"><geometry><box><size>.4 .5 .6</size></box></geometry>
    <surface><friction><ode><mu>0.4</mu></ode></friction>
      <bounce><restitution_coefficient>0.1</restitution_coefficient></bounce></surface></collision></link>
<link name="lid"><pose>0 0 .31 0 0 0</pose>
  <inertial><mass>2</mass><inertia><ixx>.1</ixx><iyy>.1</iyy><izz>.1</izz></inertia></inertial>
  <collision name="c"><geometry><box><size>.4 .5 .02</size></box></geometry></collision></link>
<joint name="hinge" type="revolute"><parent>box</parent><child>lid</child><axis><xyz>0 1 0</xyz>
  <initial_position>0.7</initial_position><limit><lower>0</lower><upper>1.5</upper></limit></axis></joint>
</model></sdf>"""
GAZEBO = robot(
    link("box", inertial(20.0, (0.4, 0.5, 0.6)) + shape("0.4 0.5 0.6")),
    link("lid", inertial(2.0, (0.4, 0.5, 0.02)) + shape("0.4 0.5 0.02")),
    joint("hinge", "revolute", "box", "lid", xyz="0 0 0.31", axis="0 1 0", limit="0 1.5"),
    '<gazebo reference="box"><mu1>0.4</mu1></gazebo>',
)


@pytest.mark.system
@pytest.mark.parametrize(
    ("name", "text", "start", "friction"),
    [("m.xml", MJCF, 0.7, {"box": 0.4, "lid": 0.4}), ("m.sdf", SDF, 0.7, {"box": 0.4}),
     ("m.urdf", GAZEBO, None, {"box": 0.4})],
)  # fmt: skip
def test_each_format_says_where_joints_start_and_how_rough_links_are(
    name: str, text: str, start: float | None, friction: dict[str, float], tmp_path: Path
) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    features = extract(AssetRef(asset_id="m", path=str(tmp_path))).features
    assert features.joint("hinge").start == start
    stated = {own.name: own.contact.friction for own in features.links if own.contact is not None}
    assert stated == friction
    overlay, _ = done(extract(AssetRef(asset_id="m", path=str(tmp_path))))
    assert overlay.contact_friction == 0.4 and overlay.contact_source is Source.AUTHORED
    assert json.loads(overlay.model_dump_json())["contact_source"] == "authored"
    assert of(overlay, "hinge").initial_position == (start or 0.0)
