"""An answer as an overlay: its numbers and nobody else's, and an engine's default where it is silent."""

from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from asset2sim.assets.authored import ENGINE_INERTIA, ENGINE_MASS_KG, authored_overlay
from asset2sim.assets.extract import Extraction
from asset2sim.assets.urdf.read import read_dynamics
from asset2sim.baselines.as_proposed import as_proposed
from asset2sim.physics.inertia import box_inertia
from schemas.asset import AssetRef
from schemas.overlay import JointPhysics, LinkPhysics, Overlay, PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import FailureMode, Method, Source
from tasks.apply import apply_overlay
from tasks.measure import Measured, measure_written
from tasks.progress import AssetJob
from tests.assets import box_obj, cabinet, joint, link, mesh, near, prior, read, robot, shape, written
from tests.methods_runs import settings_of

S = 0.3
PLAIN = Settings()


@pytest.fixture(scope="module")
def cupboard(tmp_path_factory: pytest.TempPathFactory) -> Extraction:
    return read(written(tmp_path_factory.mktemp("assets") / "cupboard", cabinet()))


def proposed(extraction: Extraction, source: Source = Source.MODEL, **fields: object) -> PhysicsOverlay:
    return as_proposed(extraction, Overlay.model_validate({"scale": S} | fields), source, PLAIN)


def measured_as_proposed(extraction: Extraction, overlay: PhysicsOverlay, out: Path) -> Measured:
    job = AssetJob(AssetRef(asset_id="thing", path=str(extraction.folder)), out, settings_of(Method.DIRECT), prior)
    applied = apply_overlay(job, extraction, None, overlay, out, rules=False)
    return measure_written(job, extraction, applied.urdf, overlay, None)


def link_of(overlay: PhysicsOverlay, name: str) -> LinkPhysics:
    return next(item for item in overlay.links if item.name == name)


def joint_of(overlay: PhysicsOverlay, name: str) -> JointPhysics:
    return next(item for item in overlay.joints if item.name == name)


def test_what_is_stated_is_written_as_it_is_however_absurd(cupboard: Extraction) -> None:
    inertia = (1.0, 9.0, 0.0, -1.0, 0.0, 0.0)
    overlay = proposed(
        cupboard,
        links=[{"name": "lid", "mass_kg": 1e9, "com": (7.0, 0.0, 0.0), "inertia": inertia, "material": "cheese"}],
        joints=[{"name": "lid_hinge", "damping": 1e9, "friction": 1e8, "stiffness": 1e7, "spring_rest": 99.0}],
        initial_joint_positions={"lid_hinge": 40.0},
        asked=("scale", "lid_hinge"),
    )
    lid, hinge = link_of(overlay, "lid"), joint_of(overlay, "lid_hinge")
    assert (lid.mass_kg, lid.com, lid.inertia, lid.material) == (1e9, (7.0, 0.0, 0.0), inertia, "cheese")
    assert (hinge.damping, hinge.friction, hinge.stiffness, hinge.spring_reference) == (1e9, 1e8, 1e7, 99.0)
    assert hinge.initial_position == 40.0 and (hinge.lower, hinge.upper) == (0.0, 1.0)
    assert (overlay.scale, overlay.scale_source, hinge.position_source) == (S, Source.USER, Source.USER)
    assert (lid.mass_source, hinge.damping_source) == (Source.MODEL, Source.MODEL)


def test_silence_leaves_the_engines_defaults_at_the_new_scale(cupboard: Extraction) -> None:
    overlay = proposed(cupboard)
    assert {(item.mass_kg, item.inertia) for item in overlay.links} == {(ENGINE_MASS_KG, ENGINE_INERTIA)}
    terms = {(item.damping, item.friction, item.stiffness, item.damping_source) for item in overlay.joints}
    assert terms == {(0.0, 0.0, 0.0, Source.AUTHORED)}
    slide, knob = joint_of(overlay, "drawer_slide"), joint_of(overlay, "knob_turn")
    assert near((slide.lower, slide.upper, slide.open), (0.0, S * 0.4, S * 0.4))
    assert (knob.lower, knob.upper, knob.initial_position) == (None, None, 0.0)


def test_at_scale_one_silence_is_the_asset_as_it_came(tmp_path: Path) -> None:
    inertial = (
        '<inertial><origin xyz="0.1 0 0"/><mass value="2"/>'
        '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    )
    dynamics = '<dynamics damping="0.3" friction="0.2" spring_stiffness="4" spring_reference="0.5"/>'
    urdf = robot(
        link("body", inertial + shape("1 1 1")),
        link("lid", shape("1 1 0.1")),
        joint("hinge", "revolute", "body", "lid", xyz="0 0 1", axis="0 1 0", limit="0.2 1", more=dynamics),
    )
    extraction = read(written(tmp_path / "thing", urdf))
    authored = authored_overlay(extraction, PLAIN.physics)
    found = proposed(extraction, scale=1.0)
    (hinge,) = found.joints
    assert hinge.effort_range is not None, "what a hand takes it for is our yardstick, not the answer's"
    alike = {"scale_source": Source.AUTHORED, "joints": (hinge.model_copy(update={"effort_range": None}),)}
    assert found.model_copy(update=alike) == authored
    half = proposed(extraction, scale=0.5)
    assert link_of(half, "body").com == (0.05, 0.0, 0.0) and link_of(half, "body").mass_kg == 2.0
    assert joint_of(half, "hinge").initial_position == 0.2


def test_a_sliders_position_is_at_the_authored_scale_and_is_not_clamped(cupboard: Extraction) -> None:
    slide = joint_of(proposed(cupboard, initial_joint_positions={"drawer_slide": 2.0}), "drawer_slide")
    assert near(slide.initial_position, S * 2.0)


def test_a_mass_without_an_inertia_has_that_of_its_box(cupboard: Extraction) -> None:
    lid = link_of(proposed(cupboard, links=[{"name": "lid", "mass_kg": 2.0}]), "lid")
    moments = box_inertia(2.0, S * np.array([0.4, 0.2, 0.1])).diagonal()
    assert near((lid.inertia[0], lid.inertia[3], lid.inertia[5]), moments)
    assert lid.inertia_source is Source.AUTHORED and lid.com == (0.0, 0.0, 0.0)


def test_a_density_and_a_hollow_factor_give_a_mass(cupboard: Extraction) -> None:
    links = [{"name": "body", "density_kg_m3": 500.0, "hollow_factor": 0.1}, {"name": "lid", "density_kg_m3": 500.0}]
    overlay = proposed(cupboard, links=links)
    assert near(link_of(overlay, "body").mass_kg, 500.0 * 0.1 * S**3)
    assert near(link_of(overlay, "lid").mass_kg, 500.0 * 0.4 * 0.2 * 0.1 * S**3)


def test_terms_that_need_rules_count_as_silence(cupboard: Extraction) -> None:
    felt = [{"name": "lid_hinge", "coast_s": 1.0, "spring_hz": 3.0, "closes_s": 2.0}]
    hinge = joint_of(proposed(cupboard, joints=felt), "lid_hinge")
    assert (hinge.damping, hinge.stiffness) == (0.0, 0.0)


def test_what_must_stay_is_judged_by_whether_it_stays(cupboard: Extraction) -> None:
    def holds(position: float | None, **fields: object) -> bool:
        states = {} if position is None else {"lid_hinge": position}
        joints = [{"name": "lid_hinge"} | fields]
        return joint_of(proposed(cupboard, joints=joints, initial_joint_positions=states), "lid_hinge").holds

    assert holds(None, holds=True) and holds(0.5) and not holds(0.01)
    assert not holds(None) and not holds(0.5, holds=False)


def test_the_users_terms_are_the_users(cupboard: Extraction) -> None:
    joints = [{"name": "lid_hinge", "damping": 0.1}, {"name": "drawer_slide", "damping": 0.1}]
    overlay = proposed(cupboard, Source.PRIOR, joints=joints, asked=("lid_hinge.damping",))
    assert joint_of(overlay, "lid_hinge").damping_source is Source.USER
    assert joint_of(overlay, "drawer_slide").damping_source is Source.PRIOR


@pytest.mark.system
def test_the_folder_states_the_numbers_and_keeps_collision_geometry(tmp_path: Path) -> None:
    """One of two meshes is missing: its reference goes, everything else stays."""
    cube = box_obj((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
    urdf = robot(
        link("body", mesh("body.obj") + mesh("gone.obj")),
        link("lid", shape("1 1 0.1")),
        joint("hinge", "revolute", "body", "lid", xyz="0 0 0.6", axis="0 1 0", limit="0 1"),
    )
    extraction = read(written(tmp_path / "thing", urdf, {"body.obj": cube}))
    overlay = proposed(
        extraction,
        links=[{"name": "body", "mass_kg": 3.0}, {"name": "lid", "mass_kg": 0.25}],
        joints=[{"name": "hinge", "damping": 0.15, "friction": 0.02, "stiffness": 0.0}],
    )
    out = tmp_path / "out"
    judged = measured_as_proposed(extraction, overlay, out)
    assert judged.verdict.mode is FailureMode.NONE
    document = etree.parse(str(out / "mobility.urdf")).getroot()
    assert [mass.get("value") for mass in document.iter("mass")] == ["3", "0.25"]
    assert [item.get("scale") for item in document.iter("mesh")] == ["0.3 0.3 0.3"] * 2
    assert len(document.findall("link/collision")) == 2 and not (out / "collision").exists()
    assert read_dynamics(out / "mobility.urdf")["hinge"].damping == 0.15


@pytest.mark.system
def test_an_inertia_that_no_body_has_is_written_and_judged(cupboard: Extraction, tmp_path: Path) -> None:
    links = [{"name": "lid", "mass_kg": 1.0, "inertia": (1.0, 0.0, 0.0, -5.0, 0.0, 1.0)}]
    overlay = proposed(cupboard, links=links)
    judged = measured_as_proposed(cupboard, overlay, tmp_path / "out")
    written_inertia = etree.parse(str(tmp_path / "out" / "mobility.urdf")).find("link[@name='lid']/inertial/inertia")
    assert written_inertia is not None and written_inertia.get("iyy") == "-5"
    assert judged.reports[0].engine == "pybullet"
