"""Own numbers in place of a model's: exact, the user's, and refused with their place where they cannot be."""

import math
from pathlib import Path

import pytest

from asset2sim.assets.extract import Extraction
from asset2sim.baselines.as_proposed import as_proposed
from asset2sim.guidance.tables import materials
from asset2sim.intake.overrides import read_overrides
from asset2sim.refinement.position_bands import band_of
from asset2sim.validation.overrides import check_overrides, overridden, prompt_findings, words_with_scale
from asset2sim.validation.validate import validate
from schemas.asset import AssetRef, Overrides
from schemas.errors import AssetError
from schemas.overlay import JointPhysics, LinkProposal, Overlay, PhysicsOverlay
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import Settings
from schemas.vocabulary import FailureMode, Method, Source
from tasks.pipeline import refine_asset
from tasks.progress import AssetJob
from tasks.synthesize import check_users_numbers, with_users_numbers
from tests.assets import cabinet, joint, link, read, robot, saying, shape, written
from tests.factories import guidance_of

PHYSICS = Settings().physics
PROPOSAL = Overlay(
    scale=0.5,
    links=tuple(
        LinkProposal(name=name, material="wood", density_kg_m3=600.0, hollow_factor=0.3)
        for name in ("body", "lid", "drawer", "knob")
    ),
    initial_joint_positions={"lid_hinge": 0.1},
)


@pytest.fixture
def thing(tmp_path: Path) -> Extraction:
    return read(written(tmp_path / "thing", cabinet()), "Box")


def own(**cells: str) -> Overrides:
    """``joint_lid_hinge`` stands for the column ``joint:lid_hinge``."""
    columns = {
        name.replace("joint_", "joint:", 1).replace("material_", "material:", 1): cell for name, cell in cells.items()
    }
    found = read_overrides(columns, "overrides.csv, line 7")
    assert found is not None
    return found


def physics(thing: Extraction, proposal: Overlay = PROPOSAL, **cells: str) -> PhysicsOverlay:
    stated = own(**cells)
    check_overrides(thing.features, stated)
    changed, _ = overridden(thing.features, proposal, stated, PHYSICS)
    return validate(thing, changed, Source.MODEL, 0.5, PHYSICS)[0]


def joint_of(overlay: PhysicsOverlay, name: str) -> JointPhysics:
    return next(item for item in overlay.joints if item.name == name)


def test_scale_and_size_are_the_users(thing: Extraction) -> None:
    scaled, sized = physics(thing, scale="0.25"), physics(thing, size_m="0.75")
    assert (scaled.scale, scaled.scale_source) == (0.25, Source.USER)
    assert sized.scale * max(thing.features.closed_size) == pytest.approx(0.75)
    assert sized.scale_source is Source.USER


def test_a_mass_is_that_of_the_whole_object_and_its_parts_keep_their_proportions(thing: Extraction) -> None:
    usual, heavy = physics(thing, scale="0.5"), physics(thing, mass_kg="40")
    assert heavy.mass_kg == pytest.approx(40.0, rel=1e-3)
    assert {item.mass_source for item in heavy.links} == {Source.USER}
    shares = [[item.mass_kg / overlay.mass_kg for item in overlay.links] for overlay in (usual, heavy)]
    assert shares[0] == pytest.approx(shares[1], rel=1e-3)
    inertias = [item.inertia[0] / item.mass_kg for overlay in (usual, heavy) for item in overlay.links[:1]]
    assert inertias[0] == pytest.approx(inertias[1])


def test_a_part_without_geometry_does_not_break_the_sum(tmp_path: Path) -> None:
    parts = robot(link("base"), link("body", shape("1 1 1")), joint("hold", "fixed", "base", "body"))
    bare = read(written(tmp_path / "bare", parts), "Box")
    assert physics(bare, Overlay(scale=0.3), mass_kg="3").mass_kg == pytest.approx(3.0, rel=1e-3)


def test_a_mass_goes_with_a_scale_that_the_model_did_not_propose(thing: Extraction) -> None:
    stated = Overlay(scale=0.5, links=(LinkProposal(name="body", mass_kg=8.0),))
    assert physics(thing, stated, scale="0.25").links[0].mass_kg == pytest.approx(1.0)


def test_a_position_is_in_the_refined_objects_unit_or_a_share(thing: Extraction) -> None:
    turned = physics(thing, joint_lid_hinge="30deg", joint_drawer_slide="0.1")
    lid, drawer = joint_of(turned, "lid_hinge"), joint_of(turned, "drawer_slide")
    assert lid.initial_position == pytest.approx(math.radians(30)) and drawer.initial_position == pytest.approx(0.1)
    assert {lid.position_source, drawer.position_source} == {Source.USER}
    half = joint_of(physics(thing, scale="0.25", joint_drawer_slide="50%"), "drawer_slide")
    assert half.initial_position == pytest.approx(0.25 * 0.2) and half.position_source is Source.USER


def test_the_search_leaves_a_number_and_may_give_a_word_its_tolerance(thing: Extraction) -> None:
    exact = joint_of(physics(thing, joint_lid_hinge="0.5"), "lid_hinge")
    word = joint_of(physics(thing, joint_lid_hinge="50%"), "lid_hinge")
    bands = [band_of(item, 0.1, 0.02) for item in (exact, word)]
    assert [band.high - band.low > 0.0 for band in bands] == [False, True]


def test_a_material_brings_its_density_and_the_mass_is_the_users(thing: Extraction) -> None:
    plain, steel = physics(thing, scale="0.5"), physics(thing, material_lid="steel")
    before, after = plain.links[1], steel.links[1]
    assert (after.material, after.mass_source) == ("steel", Source.USER)
    # Walls of steel are as thin as steel is made.
    thinner = materials()["steel"].wall_factor / materials()["wood"].wall_factor
    assert after.mass_kg == pytest.approx(before.mass_kg * 7850.0 / 600.0 * thinner)
    assert steel.links[2].mass_source is Source.MODEL


def test_methods_without_rules_take_the_numbers_too(thing: Extraction) -> None:
    changed, told = overridden(thing.features, PROPOSAL, own(scale="0.25", mass_kg="2", joint_lid_hinge="0.5"), PHYSICS)
    found = as_proposed(thing, changed, Source.MODEL, Settings())
    assert (found.scale, found.scale_source, joint_of(found, "lid_hinge").initial_position) == (0.25, Source.USER, 0.5)
    assert found.mass_kg == pytest.approx(2.0, rel=1e-2) and found.links[0].mass_source is Source.USER
    assert "overrides.csv, line 7" in told[0].message


@pytest.mark.parametrize(
    ("cells", "said"),
    [
        (
            {"joint_lid_hing": "open"},
            "column 'joint:lid_hing': there is no joint 'lid_hing'; did you mean 'lid_hinge'?",
        ),
        ({"material_lit": "steel"}, "column 'material:lit': there is no link 'lit'; did you mean 'lid'?"),
        ({"joint_lid_hinge": "30"}, "goes from 0 to 1 rad, not to 30; degrees are written as 30deg"),
        ({"joint_lid_hinge": "-0.5"}, "goes from 0 to 1 rad, not to -0.5"),
        ({"joint_lid_hinge": "0.3m"}, "joint 'lid_hinge' turns: state rad, or deg, not m"),
        ({"joint_drawer_slide": "30deg"}, "joint 'drawer_slide' slides: state m, not deg"),
        ({"joint_drawer_slide": "0.3", "scale": "0.5"}, "goes from 0 to 0.2 m, not to 0.3"),
        ({"joint_knob_turn": "open"}, "turns for ever, neither open nor closed"),
        ({"scale": "1e9"}, "column 'scale': the object's longest edge would be"),
        ({"size_m": "5000"}, "column 'size_m': the object's longest edge would be"),
    ],
)
def test_what_cannot_be_is_said_with_its_place_before_a_model_is_asked(
    thing: Extraction, cells: dict[str, str], said: str
) -> None:
    with pytest.raises(AssetError) as error:
        check_overrides(thing.features, own(**cells))
    assert said in str(error.value) and str(error.value).startswith("overrides.csv, line 7, column ")
    assert error.value.mode is FailureMode.NO_VALID_ESTIMATE


@pytest.mark.parametrize(
    ("cells", "said"),
    [
        ({"mass_kg": "1e6"}, "it cannot weigh 1e+06 kg"),
        ({"mass_kg": "1e-6"}, "it cannot weigh 1e-06 kg"),
        ({"joint_drawer_slide": "0.3"}, "goes from 0 to 0.2 m, not to 0.3"),
    ],
)
def test_what_only_the_scale_shows_is_said_once_it_is_known(
    thing: Extraction, cells: dict[str, str], said: str
) -> None:
    check_overrides(thing.features, own(**cells))
    with pytest.raises(AssetError, match=r"overrides\.csv, line 7, column") as error:
        overridden(thing.features, PROPOSAL, own(**cells), PHYSICS)
    assert said in str(error.value)


def test_a_joint_that_cannot_move_is_not_unknown(tmp_path: Path) -> None:
    parts = robot(link("a", shape("1 1 1")), link("b", shape("1 1 1")), joint("weld", "fixed", "a", "b"))
    with pytest.raises(AssetError, match="joint 'weld' cannot move"):
        check_overrides(read(written(tmp_path / "welded", parts)).features, own(joint_weld="0.1"))


def test_models_are_told_the_users_scale(thing: Extraction) -> None:
    assert words_with_scale("A box.", own(scale="0.25").scale_of(thing.features)) == "A box. Scale it to 0.250000."
    assert words_with_scale(None, own(mass_kg="1").scale_of(thing.features)) is None


def job(thing: Extraction, method: Method = Method.ASSET2SIM, prompt: str = "", **cells: str) -> AssetJob:
    ref = AssetRef(asset_id="thing", path=str(thing.folder), prompt=prompt, overrides=own(**cells) if cells else None)
    return AssetJob(ref, thing.folder, Settings(method=method), saying({}), guidance_of(prompt, thing.features))


def test_a_wrong_name_is_refused(thing: Extraction) -> None:
    with pytest.raises(AssetError, match="did you mean 'lid_hinge'"):
        check_users_numbers(job(thing, joint_lid="open"), thing)


def test_a_wrong_name_costs_no_model_call_and_a_failing_model_no_finding(thing: Extraction, tmp_path: Path) -> None:
    asked: list[ModelRequest] = []

    def fail(request: ModelRequest) -> ModelAnswer:
        asked.append(request)
        return ModelAnswer(content=None, calls=(), error="nobody is there")

    ref = job(thing, prompt="-3 kg", joint_lid="open").ref
    wrong = refine_asset(ref, tmp_path / "out", Settings(), fail)
    assert wrong.failure_mode is FailureMode.NO_VALID_ESTIMATE and not asked, wrong.reason
    failed = refine_asset(ref.model_copy(update={"overrides": None}), tmp_path / "out", Settings(), fail)
    assert failed.failure_mode is FailureMode.MODEL_ERROR and asked
    assert "prompt_number_unmet" in [finding.code for finding in failed.findings]


def test_raw_measures_the_asset_as_it_came_and_says_so(thing: Extraction) -> None:
    done = with_users_numbers(lambda job, extraction: (None, (), ()), job(thing, Method.RAW, scale="1"), thing)
    assert done.proposal is None and [item.code for item in done.findings] == ["overrides_unused"]


def test_numbers_of_the_prompt_that_cannot_be_met_are_findings(thing: Extraction) -> None:
    told = prompt_findings(guidance_of("A box 5 km long, -3 kg, scale to 1e9.", thing.features))
    assert [item.code for item in told] == ["prompt_number_unmet"] * 3
    assert "'5 km long' in the prompt cannot be met: objects are 5 mm to 5 m" in told[0].message
    done = check_users_numbers(job(thing, prompt="-3 kg"), thing)
    assert [item.code for item in done.findings] == ["prompt_number_unmet"]
