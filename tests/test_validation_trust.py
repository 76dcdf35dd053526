"""How far a file in metres is believed, of masses and of joints, and what becomes of what it says."""

import json
from pathlib import Path

import pytest

from asset2sim.assets.extract import Extraction
from asset2sim.catalog.summarize import kept_columns, kept_counts, totals
from asset2sim.intake.dataset import load_dataset
from asset2sim.intake.origin import extract
from asset2sim.models.object_facts import object_facts
from asset2sim.refinement.context import Log, RefinementContext
from asset2sim.refinement.dynamics.mend import with_supplied_terms
from asset2sim.report.object_page import kept_rows
from asset2sim.validation.validate import validate
from schemas.asset import AssetRef
from schemas.authored import keep_words
from schemas.errors import UsageError
from schemas.inputs import InputSettings
from schemas.mechanism import Bias
from schemas.overlay import JointPhysics, JointProposal, LinkProposal, Overlay, PhysicsOverlay
from schemas.settings import EngineSettings, PhysicsSettings, Settings
from schemas.verdict import Failure
from schemas.vocabulary import CollisionMode, Engine, FailureMode, Quantity, Source, Status, Trust
from tasks.apply import apply_overlay
from tasks.pipeline import refine_asset
from tasks.progress import AssetJob
from tests.assets import NO_VIEWS, joint, link, prior, robot, shape, written

MASS_FACTOR = 1.05
"""Factor within which a believed mass stays what its file says, whatever else is done to the object."""


def inertial(mass: float, size: tuple[float, float, float], factor: float = 1.0, at: str = "0 0 0") -> str:
    """The inertial of a solid box, its moments times ``factor``."""
    x, y, z = (edge**2 for edge in size)
    moments = [factor * mass / 12.0 * value for value in (y + z, x + z, x + y)]
    stated = "".join(f' {name}="{value}"' for name, value in zip(("ixx", "iyy", "izz"), moments, strict=True))
    return f'<inertial><origin xyz="{at}"/><mass value="{mass}"/><inertia{stated} ixy="0" ixz="0" iyz="0"/></inertial>'


def cabinet(
    folder: Path, door: str = "", drawer: str = "", *, weighed: bool = True, door_kg: float = 3.0,
    drawer_kg: float = 1.5, factor: float = 1.0, at: str = "0 0.24 0", helper: bool = False, ballast: str = "",
    keep: tuple[str, ...] | None = None,
) -> Extraction:  # fmt: skip
    """A cabinet of 20 kg with a door on an upright hinge and a drawer, and what its file says of their joints."""
    said = [inertial(20.0, (0.4, 0.5, 0.6)), inertial(door_kg, (0.02, 0.48, 0.28), factor, at)]
    said += [inertial(drawer_kg, (0.3, 0.4, 0.2))]
    # Lengths of a ruler would say that it is in metres, and so would such as no dataset brings its objects to.
    body, own, inner = ("0.4 0.5 0.6", "0.02 0.48 0.28", "0.3 0.4 0.2") if weighed else (
        "0.82546 1.03182 1.23818", "0.04128 0.99054 0.57782", "0.6191 0.82546 0.41272")  # fmt: skip
    shapes = [shape(body), shape(own, xyz="0 0.24 0"), shape(inner)]
    names = ("body", "door", "drawer")
    texts = (text if weighed else "" for text in said)
    parts = [link(name, text + form) for name, text, form in zip(names, texts, shapes, strict=True)]
    below = "body"
    if helper:
        parts += [link("hinge_frame", ballast), joint("frame", "fixed", "body", "hinge_frame")]
        below = "hinge_frame"
    parts.append(joint("door_hinge", "revolute", below, "door", xyz="0.212 -0.24 -0.15", axis="0 0 -1", limit="0 1.5",
                       more=f"<dynamics {door}/>"))  # fmt: skip
    parts.append(joint("drawer_slide", "prismatic", "body", "drawer", xyz="0.36 0 0.16", axis="1 0 0", limit="0 0.2",
                       more=f"<dynamics {drawer}/>"))  # fmt: skip
    place = written(folder, robot(*parts))
    return extract(AssetRef(asset_id=folder.name, path=str(place), keep=keep))


LIGHT = Overlay(
    scale=1.0,
    links=tuple(LinkProposal(name=name, density_kg_m3=40.0) for name in ("body", "door", "drawer")),
    joints=(JointProposal(name="door_hinge", coast_s=0.4), JointProposal(name="drawer_slide", coast_s=0.3)),
)


def done(item: Extraction, overlay: Overlay = LIGHT, *, keep_terms: bool = True) -> PhysicsOverlay:
    return validate(item, overlay, Source.MODEL, 0.5, PhysicsSettings(), keep_terms=keep_terms)[0]


def trusts(overlay: PhysicsOverlay, quantity: Quantity) -> dict[str, Trust]:
    return {name: item.trust for item in overlay.authored if item.quantity is quantity for name in item.of}


def of(overlay: PhysicsOverlay, name: str) -> JointPhysics:
    return next(item for item in overlay.joints if item.name == name)


def test_damping_and_friction_that_a_hand_bears_stay(tmp_path: Path) -> None:
    item = cabinet(tmp_path / "a", 'damping="0.8" friction="1.2"', 'damping="6" friction="4"')
    overlay = done(item)
    hinge, slide = of(overlay, "door_hinge"), of(overlay, "drawer_slide")
    assert (hinge.damping, hinge.friction, slide.damping, slide.friction) == (0.8, 1.2, 6.0, 4.0)
    sources = {getattr(own, f"{term}_source") for own in (hinge, slide) for term in ("damping", "friction")}
    assert sources == {Source.AUTHORED} and overlay.scale_source is Source.AUTHORED
    assert set(trusts(overlay, Quantity.DAMPING).values()) == {Trust.PLAUSIBLE}
    said = LIGHT.model_copy(
        update={
            "asked": ("door_hinge.dynamics",),
            "joints": (JointProposal(name="door_hinge", damping=0.5, friction=0.3),),
        }
    )
    theirs = of(done(item, said), "door_hinge")
    assert (theirs.damping, theirs.damping_source) == (0.5, Source.USER), "the user's own number goes first"


def test_numbers_that_no_such_part_has_are_supplied_and_the_reason_is_said(tmp_path: Path) -> None:
    def judged(door: str, drawer: str = "", quantity: Quantity = Quantity.DAMPING) -> tuple[Trust, Source, str]:
        overlay = done(cabinet(tmp_path / "a", door, drawer))
        term = {"damping": "damping", "friction": "friction", "springs": "stiffness"}[quantity]
        (found,) = (item for item in overlay.authored if item.quantity is quantity and "door_hinge" in item.of)
        return found.trust, getattr(of(overlay, "door_hinge"), f"{term}_source"), found.reason

    trust, source, why = judged('damping="300"')
    assert (trust, source) == (Trust.DOUBTFUL, Source.MODEL) and "hand" in why
    assert judged('damping="0.0005"')[:2] == (Trust.DOUBTFUL, Source.MODEL), "it would coast for minutes"
    assert judged('damping="-1"')[0] is Trust.IMPOSSIBLE
    trust, source, why = judged('damping="1"', 'damping="1"')
    assert (trust, source) == (Trust.DOUBTFUL, Source.MODEL) and "same" in why, "a hinge and a slider"
    assert judged('friction="60"', quantity=Quantity.FRICTION)[0] is Trust.DOUBTFUL
    assert judged('spring_stiffness="90"', quantity=Quantity.SPRINGS)[0] is Trust.DOUBTFUL
    trust, source, why = judged('spring_stiffness="0.002"', quantity=Quantity.SPRINGS)
    assert (trust, source) == (Trust.DOUBTFUL, Source.RULE) and "half a minute" not in why, "no hand feels it"


def test_a_spring_stays_with_its_rest(tmp_path: Path) -> None:
    item = cabinet(tmp_path / "a", 'damping="0.5" spring_stiffness="2.0" spring_reference="-0.6"')
    hinge = of(done(item), "door_hinge")
    assert (hinge.stiffness, hinge.spring_reference, hinge.stiffness_source) == (2.0, -0.6, Source.AUTHORED)
    assert hinge.initial_position == 0.0 and not hinge.holds
    asked = LIGHT.model_copy(update={"initial_joint_positions": {"door_hinge": 1.0}, "asked": ("door_hinge",)})
    assert of(done(item, asked), "door_hinge").stiffness == 0.0, "the user asks it to stand open"


def test_a_spring_that_carries_its_part_is_judged_with_the_weight_that_it_carries(tmp_path: Path) -> None:
    # A flap of 10 kg and 0.6 m, hinged below: 29.4 sin(q) N·m. Beside 20 (-0.1 - q) N·m a hand feels 3 N·m at most.
    spring = 'spring_stiffness="20" spring_reference="-0.1"'

    def flap(more: str, axis: str = "0 1 0") -> JointPhysics:
        parts = [
            link("body", inertial(60.0, (0.6, 0.6, 0.8)) + shape("0.6 0.6 0.8")),
            link("flap", inertial(10.0, (0.02, 0.58, 0.6), at="0 0 0.3") + shape("0.02 0.58 0.6", xyz="0 0 0.3")),
            joint("hinge", "revolute", "body", "flap", xyz="0.312 0 -0.3", axis=axis, limit="0 1.5",
                  more=f"<dynamics {more}/>"),
        ]  # fmt: skip
        item = extract(AssetRef(asset_id="a", path=str(written(tmp_path / "a", robot(*parts)))))
        return of(done(item, Overlay(scale=1.0, links=LIGHT.links[:1], joints=())), "hinge")

    held = flap(f'damping="2" friction="4" start="0.75" {spring}')
    assert (held.stiffness, held.spring_reference, held.stiffness_source) == (20.0, -0.1, Source.AUTHORED)
    assert (held.initial_position, held.position_source, held.holds) == (0.75, Source.AUTHORED, True)
    let_go = flap(f'damping="2" friction="1" start="0.75" {spring}')
    assert let_go.stiffness_source is Source.AUTHORED and let_go.position_source is not Source.AUTHORED
    upright = f'damping="2" friction="4" start="0.75" {spring.replace("20", "70")}'
    assert flap(upright, axis="0 0 1").stiffness_source is not Source.AUTHORED, "it carries nothing: no hand turns it"


@pytest.mark.parametrize(
    ("stiffness", "takes_n", "kept"),
    [(11.3, 35.3, True), (28.0, 87.5, True), (90.0, 281.0, False)],
    ids=["a door's closer", "the strongest closer", "no closer"],
)
def test_a_spring_is_its_authors_though_a_supplied_one_would_be_weaker(
    stiffness: float, takes_n: float, kept: bool, tmp_path: Path
) -> None:
    """A leaf of 0.48 m that opens by 1.5 rad against its spring, where an interior door should take 22.2 N."""
    hinge = of(done(cabinet(tmp_path / "a", f'damping="0.5" spring_stiffness="{stiffness}"')), "door_hinge")
    asked = hinge.effort_range
    assert (hinge.stiffness_source is Source.AUTHORED) is kept and asked is not None
    assert (asked.most_n >= takes_n) is kept, (
        "the part may take what its own spring does, and no more where it has none"
    )


def test_a_start_stays_where_the_spring_is_not_believed_that_would_bring_its_part_elsewhere(tmp_path: Path) -> None:
    for stiffness, source in ((60.0, Source.RULE), (4000.0, Source.AUTHORED)):
        text = f'damping="5" start="0.1" spring_stiffness="{stiffness:g}"'
        drawer = of(done(cabinet(tmp_path / f"{stiffness:g}", drawer=text)), "drawer_slide")
        assert (drawer.stiffness > 0.0, drawer.position_source) == (source is Source.RULE, source)
        assert drawer.initial_position == (0.1 if source is Source.AUTHORED else 0.0)


def test_a_spring_that_is_kept_asks_no_more_of_its_part_than_it_gives(tmp_path: Path) -> None:
    # Believed by its force at the end of the range, it gives none at the start where it is relaxed, as a latch's does.
    def least(door: str, keep_terms: bool = True) -> tuple[float, float, str]:
        hinge = of(done(cabinet(tmp_path / "a", door), keep_terms=keep_terms), "door_hinge")
        assert hinge.effort_range is not None
        return hinge.stiffness, hinge.effort_range.least_n, hinge.effort_range.source

    relaxed = 'damping="0.5" spring_stiffness="2.0"'
    stiffness, asked, source = least(relaxed)
    assert (stiffness, asked) == (2.0, 0.0) and source.endswith("as light as stated")
    assert least(relaxed, keep_terms=False)[1] > 0.0, "a spring of the program's own is made to be felt"


def test_a_spring_stiffer_than_its_part_bears_alone_has_an_armature(tmp_path: Path) -> None:
    for drawer_kg, armature in ((1.5, False), (0.121, True)):
        item = cabinet(tmp_path / "a", drawer='spring_stiffness="110"', drawer_kg=drawer_kg)
        slide = of(done(item), "drawer_slide")
        assert (slide.stiffness, slide.stiffness_source, slide.spring_reference) == (110.0, Source.AUTHORED, 0.0)
        assert (slide.armature > 0.0) is armature


def test_friction_that_holds_its_part_is_not_raised(tmp_path: Path) -> None:
    proposal = LIGHT.model_copy(update={"joints": (LIGHT.joints[0], JointProposal(name="drawer_slide", holds=True))})
    item = cabinet(tmp_path / "a", drawer='friction="1"')
    assert of(done(item, proposal, keep_terms=False), "drawer_slide").friction > 1.4, "a bump asks for more"
    overlay, findings = validate(item, proposal, Source.MODEL, 0.5, PhysicsSettings())
    assert of(overlay, "drawer_slide").friction == 1.0
    assert "drawer_slide" not in [found.joint for found in findings if found.code == "friction_bounded"]


def test_centre_and_inertia_stay_or_go_alone(tmp_path: Path) -> None:
    def sources(overlay: PhysicsOverlay) -> tuple[Source, Source, Source]:
        door = next(item for item in overlay.links if item.name == "door")
        return door.mass_source, door.com_source, door.inertia_source

    assert sources(done(cabinet(tmp_path / "a"))) == (Source.AUTHORED,) * 3
    assert sources(done(cabinet(tmp_path / "b", factor=50.0))) == (Source.AUTHORED, Source.AUTHORED, Source.RULE)
    assert sources(done(cabinet(tmp_path / "c", at="0 3 0"))) == (Source.AUTHORED, Source.RULE, Source.AUTHORED)
    copied = sources(done(cabinet(tmp_path / "d", at="0 3 0", factor=50.0)))
    assert Source.AUTHORED not in copied, "a mass goes with them where both are another body's"
    heavy = done(cabinet(tmp_path / "d", door_kg=90.0))
    assert sources(heavy) == (Source.MODEL, Source.RULE, Source.RULE)
    assert trusts(heavy, Quantity.MASS) == {
        "body": Trust.PLAUSIBLE, "door": Trust.DOUBTFUL, "drawer": Trust.PLAUSIBLE
    }  # fmt: skip


@pytest.mark.parametrize("helper", [False, True])
def test_a_believed_mass_stays_within_the_stated_factor(helper: bool, tmp_path: Path) -> None:
    item = cabinet(tmp_path / "a", helper=helper)
    stated = {own.name: own.inertial.mass_kg for own in item.features.links if own.inertial is not None}
    written_kg = {own.name: own.mass_kg for own in done(item).links}
    for name, mass in stated.items():
        assert mass / MASS_FACTOR <= written_kg[name] <= mass * MASS_FACTOR, "a frame without a shape takes hardly any"


@pytest.mark.parametrize(
    ("ballast", "trust"),
    [
        (inertial(1.3, (0.2, 0.2, 0.2)), Trust.PLAUSIBLE),
        (inertial(1.3, (0.2, 0.2, 0.2), at="0 0 2"), Trust.DOUBTFUL),
        (inertial(1.3, (9.0, 9.0, 9.0)), Trust.DOUBTFUL),
        (inertial(30.0, (0.2, 0.2, 0.2)), Trust.DOUBTFUL),
        ('<inertial><mass value="1.3"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>',
         Trust.DOUBTFUL),
    ],
)  # fmt: skip
def test_a_mass_without_a_shape_is_believed_beside_what_it_is_joined_to(
    ballast: str, trust: Trust, tmp_path: Path
) -> None:
    written_as = done(cabinet(tmp_path / "a", helper=True, ballast=ballast))
    masses = {own.name: own.mass_kg for own in written_as.links}
    assert trusts(written_as, Quantity.MASS)["hinge_frame"] is trust
    if trust is Trust.PLAUSIBLE:
        assert masses == {"body": 20.0, "door": 3.0, "drawer": 1.5, "hinge_frame": 1.3}
    else:
        assert masses["hinge_frame"] < 0.3, "it takes hardly any of another's"


def stack(folder: Path, first: str, second: str) -> dict[str, Trust]:
    """Two shelves of one shape, each with an inertial of its own, on a rack without; how far masses are believed."""
    parts = [link("rack", shape("0.4 0.5 0.6"))]
    parts += [link(name, said + shape("0.4 0.5 0.02")) for name, said in (("low", first), ("high", second))]
    slides = [joint(f"{name}_slide", "prismatic", "rack", name, xyz=f"0.1 0 {z}", axis="1 0 0", limit="0 0.3")
              for name, z in (("low", 0.1), ("high", 0.3))]  # fmt: skip
    item = extract(AssetRef(asset_id=folder.name, path=str(written(folder, robot(*parts, *slides)))))
    return trusts(done(item, Overlay(scale=1.0)), Quantity.MASS)


def test_alike_parts_may_weigh_alike_where_their_inertia_is_their_own(tmp_path: Path) -> None:
    own, written_for_all = inertial(1.6, (0.4, 0.5, 0.02)), inertial(1.6, (1.0, 1.0, 1.0))
    assert set(stack(tmp_path / "a", own, own).values()) == {Trust.PLAUSIBLE}, "two shelves of one shape"
    assert set(stack(tmp_path / "b", written_for_all, written_for_all).values()) == {Trust.DOUBTFUL}


def test_the_mass_and_inertia_that_sdf_gives_by_default_are_not_weighed(tmp_path: Path) -> None:
    default = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    found = stack(tmp_path, default, default.replace('mass value="1"', 'mass value="1.2"'))
    assert (found["low"], found["high"]) == (Trust.DOUBTFUL, Trust.PLAUSIBLE)


def test_a_part_that_follows_another_may_be_as_light_as_its_author_made_it(tmp_path: Path) -> None:
    def light(mimic: str) -> Trust:
        parts = [link("hood", inertial(5.0, (0.4, 0.5, 0.6)) + shape("0.4 0.5 0.6")),
                 link("switch", inertial(0.1, (0.05, 0.05, 0.05)) + shape("0.05 0.05 0.05")),
                 link("lamp", inertial(0.01, (0.4, 0.5, 0.03)) + shape("0.4 0.5 0.03"))]  # fmt: skip
        joints = [joint("turn", "revolute", "hood", "switch", xyz="0.25 0 0", axis="0 1 0", limit="0 0.7"),
                  joint("rise", "prismatic", "hood", "lamp", xyz="0 0 0.4", axis="0 0 1", limit="0 0.05",
                        more=mimic)]  # fmt: skip
        folder = tmp_path / ("tied" if mimic else "alone")
        item = extract(AssetRef(asset_id="a", path=str(written(folder, robot(*parts, *joints)))))
        return trusts(done(item, Overlay(scale=1.0)), Quantity.MASS)["lamp"]

    assert light('<mimic joint="turn" multiplier="0.07"/>') is Trust.PLAUSIBLE and light("") is Trust.DOUBTFUL


def test_a_file_of_unknown_unit_is_not_judged(tmp_path: Path) -> None:
    overlay = done(cabinet(tmp_path / "a", 'damping="0.8" friction="1.2"', weighed=False))
    assert overlay.authored == () and "authored" not in overlay.model_dump()
    assert of(overlay, "door_hinge").damping_source is Source.MODEL
    assert kept_columns(overlay)["authored_json"] is None


def test_terms_with_which_a_check_fails_are_supplied_for_the_joint_that_fails(tmp_path: Path) -> None:
    item = cabinet(tmp_path / "a", 'damping="0.8" friction="1.2"', 'damping="6" friction="4"')
    overlay = done(item)
    loop = RefinementContext(item, LIGHT, overlay, Source.MODEL, {}, Settings(), Log())
    failure = Failure(Engine.MUJOCO, FailureMode.EFFORT, "door_hinge", "too stiff", 30.0, 22.2)
    changed = with_supplied_terms(loop, overlay, [failure])
    assert changed is not None
    assert of(changed, "door_hinge").damping_source is Source.MODEL and of(changed, "door_hinge").friction != 1.2
    assert of(changed, "drawer_slide") == of(overlay, "drawer_slide")
    both = with_supplied_terms(loop, overlay, [Failure(Engine.MUJOCO, FailureMode.DRIFT, "", "it drifts", 1.0, 0.1)])
    assert both is not None and of(both, "drawer_slide").damping_source is Source.MODEL
    assert with_supplied_terms(loop, changed, [failure]) is None, "nothing of the file's is left there"
    seal = Bias(kind="seal", slope=1.0, none_at=0.0, least=-1.0, most=0.0)
    hinges = [joint.model_copy(update={"bias": seal}) for joint in overlay.joints]
    sealed = with_supplied_terms(loop, overlay.model_copy(update={"joints": tuple(hinges)}), [failure])
    assert sealed is not None and of(sealed, "door_hinge").bias is None, "the rules' friction goes with their mechanism"


def test_what_is_kept_mended_and_supplied_is_counted_and_told(tmp_path: Path) -> None:
    overlay = done(cabinet(tmp_path / "a", 'damping="300" friction="1.2"', door_kg=90.0))
    counts = kept_counts(overlay)
    assert counts[Quantity.MASS, "kept"] == 2 and counts[Quantity.MASS, "mended"] == 1
    assert counts[Quantity.DAMPING, "mended"] == 1 and counts[Quantity.DAMPING, "supplied"] == 1
    assert counts[Quantity.FRICTION, "kept"] == 1 and counts[Quantity.SIZE, "kept"] == 1
    columns = kept_columns(overlay)
    assert (columns["kept"], columns["supplied"], columns["mended"]) == totals(counts)
    rows = {quantity: (how, said) for quantity, how, said in kept_rows(columns)}
    assert rows["mass"][0] == "2 kept, 1 mended" and "doubtful (door): not 5 to 12000 kg/m³" in rows["mass"][1]
    assert json.loads(str(columns["authored_json"])) and "springs" not in rows


UNBELIEVED = 'damping="300" friction="1.2"'
"""A door's hinge as if it stood in honey."""


def test_what_is_named_stays_though_it_is_doubtful(tmp_path: Path) -> None:
    def numbers(*keep: str, scale: float = 1.0, door_kg: float = 90.0) -> tuple[float, float, float]:
        item = cabinet(tmp_path / "a", UNBELIEVED, door_kg=door_kg, keep=keep or None)
        overlay = done(item, LIGHT.model_copy(update={"scale": scale}))
        door = next(own for own in overlay.links if own.name == "door")
        return overlay.scale, door.mass_kg, of(overlay, "door_hinge").friction

    light_kg = 40.0 * 0.02 * 0.48 * 0.28 * PhysicsSettings().fallback_hollow_factor
    assert numbers()[1:] == pytest.approx((light_kg, 1.2)), "plausible, where nothing is said"
    assert numbers("mass")[1] == 90.0 and numbers("mass")[2] != 1.2
    assert numbers("plausible", "mass")[1] == 90.0
    assert numbers("mass", scale=0.5, door_kg=3.0)[:2] == (0.5, 3.0), "a mass stays whatever the size becomes"
    assert numbers("size", scale=0.5)[0] == 1.0, "an answer of another size counts for nothing"
    assert numbers("nothing") == pytest.approx((1.0, light_kg, numbers("size")[2]))
    everything = done(cabinet(tmp_path / "b", UNBELIEVED, door_kg=90.0, keep=("all",)))
    (said,) = (item for item in everything.authored if item.quantity is Quantity.MASS and item.of == ("door",))
    assert said.trust is Trust.PLAUSIBLE and said.reason.startswith("kept as asked, though not 5 to")
    assert done(cabinet(tmp_path / "c", 'damping="-1"', keep=("all",))).joints[0].damping > 0.0, (
        "impossible all the same"
    )


def test_a_row_of_the_manifest_goes_before_the_run(tmp_path: Path) -> None:
    cabinet(tmp_path / "data" / "one")
    manifest = tmp_path / "data" / "manifest.csv"
    manifest.write_text('asset_id,path,keep\none,one,"mass, size"\n', encoding="utf-8")
    (ref,) = load_dataset(tmp_path / "data", None, (), None)
    assert ref.keep == ("mass", "size") == keep_words("mass,size")
    assert extract(ref, inputs=InputSettings(keep=("nothing",))).features.keep == ("mass", "size")
    assert InputSettings.model_validate_json('{"keep": "plausible"}').keep == ("plausible",), "a file of an earlier run"
    manifest.write_text("asset_id,path,keep\none,one,weight\n", encoding="utf-8")
    with pytest.raises(UsageError, match=r"line 2: keep 'weight': 'weight' is none of plausible, all"):
        load_dataset(tmp_path / "data", None, (), None)
    with pytest.raises(ValueError, match="beside others"):
        keep_words("nothing mass")


def test_shapes_stay_where_they_are_named(tmp_path: Path) -> None:
    def mode(*keep: str) -> CollisionMode:
        item = cabinet(tmp_path / "a", keep=keep or None)
        ref = AssetRef(asset_id="a", path=str(item.folder), keep=keep or None)
        job = AssetJob(ref, tmp_path / "out", NO_VIEWS, prior)
        applied = apply_overlay(job, item, LIGHT, done(item), tmp_path / "made", rules=True)
        assert applied.to_refine is not None
        return applied.to_refine[0].settings.collision.mode

    assert mode("plausible", "shapes") is mode("all") is CollisionMode.KEEP
    assert mode() is NO_VIEWS.collision.mode is not CollisionMode.KEEP


def test_a_model_is_told_what_a_file_in_metres_says_of_its_joints(tmp_path: Path) -> None:
    def told(*, weighed: bool) -> list[object]:
        facts = object_facts(cabinet(tmp_path / "a", 'damping="0.8"', weighed=weighed).features)
        joints = facts["joints"]
        assert isinstance(joints, list)
        return [item.get("file_states") for item in joints]

    assert told(weighed=True) == [{"damping": 0.8}, None] and told(weighed=False) == [None, None]


@pytest.mark.system
@pytest.mark.parametrize("too_much", [False, True])
def test_an_object_with_physics_of_its_own_keeps_them_through_every_check(too_much: bool, tmp_path: Path) -> None:
    # Friction and spring that a hand bears each, but not together, which a check says: the friction is mended.
    door = 'friction="10" spring_stiffness="5" spring_reference="-0.2"' if too_much else 'friction="1.2" damping="0.5"'
    item = cabinet(tmp_path / "one", door, 'damping="6" friction="4"')
    ref = AssetRef(asset_id="one", path=str(item.folder), category="StorageFurniture")
    engine = EngineSettings(verify=(Engine.PYBULLET,))
    record = refine_asset(ref, tmp_path / "out", NO_VIEWS.model_copy(update={"engine": engine}), prior)
    assert record.status is Status.OK, record.reason
    overlay = json.loads((tmp_path / "out" / "assets" / "one" / "overlay.json").read_text(encoding="utf-8"))
    hinge, slide = (
        next(own for own in overlay["joints"] if own["name"] == name) for name in ("door_hinge", "drawer_slide")
    )
    assert (slide["damping"], slide["friction"]) == (6.0, 4.0) and slide["friction_source"] == "authored"
    assert {own["mass_source"] for own in overlay["links"]} == {"authored"} == {overlay["scale_source"]}
    assert (hinge["friction_source"] == "authored") is not too_much
    assert ("door_hinge" in [found.joint for found in record.findings if found.code == "mended"]) is too_much
    assert {item["quantity"] for item in overlay["authored"]} >= {"size", "mass", "centre", "inertia", "friction"}
