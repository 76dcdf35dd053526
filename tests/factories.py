"""Asset records for tests: complete ones with stated numbers, and failed ones that stopped early."""

from collections.abc import Sequence
from datetime import UTC, datetime

from asset2sim.catalog.run import RunRow
from asset2sim.checks.alignment.align import align
from asset2sim.checks.alignment.expectations import expectations_met, misfits
from asset2sim.guidance.read import read_guidance
from asset2sim.models.object_facts import rounded_object_info
from schemas.alignment import Alignment, Expectation, Expected, Reference, Score
from schemas.asset import AssetRecord, AssetRef
from schemas.features import Features, JointFeatures, LinkFeatures, MeshFeatures
from schemas.finding import Finding, TraceStep
from schemas.guidance import Guidance
from schemas.interaction import (
    ContactPair,
    Drop,
    EngineReport,
    Interaction,
    JointMotion,
    Measurement,
    Opening,
    OverlapPair,
)
from schemas.overlay import JointPhysics, LinkPhysics, PhysicsOverlay
from schemas.request import ModelCall
from schemas.vocabulary import Engine, FailureMode, Method, OverlapCause, Severity, Source, Stage, Status, VolumeSource

MODEL = "prior/household"
UNSTATED = (Stage.ALIGN, Stage.PUBLISH)
"""Stages that a made record states no time of."""


def make_call(**changes: object) -> ModelCall:
    """A successful call of 1000 + 200 tokens at 0.01 USD."""
    fields: dict[str, object] = {
        "purpose": "overlay", "model": MODEL, "attempt": 1, "prompt_tokens": 1000, "completion_tokens": 200,
        "cost_usd": 0.01, "latency_s": 0.5, "cached": False, "outcome": "ok", "prompt_hash": "abc",
    }  # fmt: skip
    return ModelCall.model_validate(fields | changes)


def make_run(run_id: str = "20260101T000000-1", **changes: object) -> RunRow:
    """A run that began and ended at one moment of 2026-01-02."""
    now = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
    fields: dict[str, object] = {"run_id": run_id, "started_at": now, "finished_at": now, "dataset": "data/raw"}
    return RunRow.model_validate(fields | changes)


def make_measurement(**changes: object) -> Measurement:
    """A quiet object: Φ 0.5 mm, drift 0.1 mm and 0.001 rad, one hinge and one slider that hardly move."""
    fields: dict[str, object] = {
        "engine": "pybullet", "engine_version": "3.2.7", "timestep_s": 1 / 240, "settle_s": 2.0, "test_s": 2.0,
        "penetration_m": 0.0005,
        "pairs": (ContactPair(link_a="body", link_b="door", depth_m=0.0003, penetration_m=0.0005, n_points=2),),
        "drift_m": 1e-4, "drift_rad": 1e-3, "peak_speed_m_s": 0.2,
        "joints": (make_motion("hinge"), make_motion("slider")),
        "settle_motion": {"hinge": 0.002, "slider": 0.0}, "finite": True,
    }  # fmt: skip
    return Measurement.model_validate(fields | changes)


def make_motion(name: str, amplitude: float = 0.001, sign_changes: int = 0) -> JointMotion:
    """Motion of one joint over the test."""
    return JointMotion(name=name, amplitude=amplitude, sign_changes=sign_changes, final_position=0.1)


def make_drop(**changes: object) -> Drop:
    """A drop from 5 cm that ends at rest."""
    fields: dict[str, object] = {
        "timestep_s": 1 / 240, "height_m": 0.05, "seconds": 1.0, "peak_speed_m_s": 1.0, "final_speed_m_s": 0.0,
        "sink_m": 0.0, "finite": True,
    }  # fmt: skip
    return Drop.model_validate(fields | changes)


def make_report(engine: Engine, **changes: object) -> EngineReport:
    """An engine in which the object is quiet, falls well, and has a hinge that 0.01 N·m opens."""
    interaction = Interaction(
        engine=engine,
        drops=(make_drop(), make_drop(timestep_s=1 / 60)),
        openings=(Opening(joint="hinge", opening=0.01, closing=None),),
    )
    fields: dict[str, object] = {
        "engine": engine, "engine_version": "1.0", "measurement": make_measurement(engine=engine.value),
        "interaction": interaction, "seconds": 0.4,
    }  # fmt: skip
    return EngineReport.model_validate(fields | changes)


def make_link(name: str, mass_kg: float = 1.0) -> LinkPhysics:
    """A link of 1 litre."""
    return LinkPhysics(
        name=name, label=name, material="plastic", density_kg_m3=1000.0, hollow_factor=1.0, volume_m3=1e-3,
        volume_source=VolumeSource.HULL, mass_kg=mass_kg, mass_source=Source.PRIOR, com=(0.0, 0.1, 0.2),
        com_source=Source.RULE, inertia=(1e-3, 0.0, 1e-5, 2e-3, 0.0, 3e-3), inertia_source=Source.RULE,
    )  # fmt: skip


def make_joint(name: str, kind: str = "revolute", initial_position: float = 0.1) -> JointPhysics:
    """A joint from 0 (closed) to 1 (open)."""
    return JointPhysics(
        name=name, type=kind, label="door", damping=0.01, damping_source=Source.RULE, friction=0.002,
        friction_source=Source.USER, stiffness=0.0, stiffness_source=Source.RULE, spring_reference=0.0, lower=0.0,
        upper=1.0, limits_source=Source.AUTHORED, closed=0.0, open=1.0, initial_position=initial_position,
        position_source=Source.USER, effective_inertia=0.001, gravity_load=0.0, holds=False,
    )  # fmt: skip


def make_features(asset_id: str) -> Features:
    """A cube of 1 m with a hinge and a slider, and the fixed joint of its root."""
    joints = (("fixed", "fixed", "base", "body"), ("hinge", "revolute", "body", "door"),
              ("slider", "prismatic", "body", "drawer"))  # fmt: skip
    links = tuple(_link_features(name) for name in ("base", "body", "door", "drawer"))
    return Features(
        asset_id=asset_id, category="Box", urdf_file="mobility.urdf", root="base", links=links,
        joints=tuple(_joint_features(*joint) for joint in joints),
        rest_box_min=(-0.5, -0.5, -0.5), rest_box_max=(0.5, 0.5, 0.5),
        closed_size=(1.0, 1.0, 1.0),
        link_centers={}, link_boxes={link.name: link.box_size for link in links}, content_hash="features",
    )  # fmt: skip


def make_record(asset_id: str = "100", **changes: object) -> AssetRecord:
    """An asset that passed, with every part of its record filled in."""
    overlay = PhysicsOverlay(
        asset_id=asset_id, scale=0.25, scale_source=Source.USER, contact_friction=0.5,
        links=(make_link("base", 0.01), make_link("body", 2.0), make_link("door", 0.5), make_link("drawer", 0.49)),
        joints=(make_joint("hinge"), make_joint("slider", "prismatic")),
    )  # fmt: skip
    fields: dict[str, object] = {
        "ref": AssetRef(asset_id=asset_id, path=f"dataset/{asset_id}", subset="paper9", prompt="a small closed box"),
        "category": "Box", "method": Method.ASSET2SIM, "model": MODEL, "status": Status.OK,
        "failure_mode": FailureMode.NONE, "reason": "within every threshold", "features": make_features(asset_id),
        "overlay": overlay, "measurement": make_measurement(),
        "reports": (make_report(Engine.PYBULLET), make_report(Engine.MUJOCO)),
        "overlaps": (OverlapPair(pair=make_measurement().pairs[0], related=True, cause=OverlapCause.HULL),),
        "alignment": make_alignment(),
        "calls": (make_call(), make_call(purpose="state", cached=True, outcome="cached")),
        "trace": (TraceStep(step=1, proposer="model", phi_before_m=0.004, phi_after_m=0.0005, moved={"hinge": 0.1},
                            accepted=True, evaluations=12, reason="Φ fell"),),
        "findings": (make_finding(Severity.WARNING, "link_completed"),),
        "seconds": {stage.value: 0.1 * (i + 1) for i, stage in enumerate(Stage) if stage not in UNSTATED},
        "written": True,
        "content_hash": f"hash-{asset_id}",
    }  # fmt: skip
    record = AssetRecord.model_validate(fields | changes)
    if record.features is None or "guidance" in changes:
        return record
    return record.model_copy(update={"guidance": guidance_of(record.ref.prompt, record.features)})


def guidance_of(words: str | None, features: Features) -> Guidance:
    """What the words ask of an object with these features."""
    return read_guidance(words or "", rounded_object_info(features))


def make_alignment(**changes: object) -> Alignment:
    """An object of the right size whose state is near, 25 % off the expert's scale and 0.2 rad off the joint's."""
    fields: dict[str, object] = {
        "scale": Score(value=1.0, reason="the scale meets a small Box"),
        "state": Score(value=0.5, reason="door closed: joint 'hinge' is 22 % open"),
        "scale_deviation": 0.25, "reference_states_scale": True, "joint_deviation": 0.2,
    }  # fmt: skip
    return Alignment.model_validate(fields | changes)


def make_expected() -> Expected:
    """A hinge that was asked for, met at the start and not at rest."""
    return Expected(
        expectation=Expectation(what="hinge", ranges=((0.2, 0.4), (1.0, 1.2)), unit="rad", lines=(2, 3)),
        at_start=True, start=0.3, at_rest=False, rest=0.5, rest_engine="mujoco",
    )  # fmt: skip


def make_failure(asset_id: str, mode: FailureMode, code: str = "bad_file", **changes: object) -> AssetRecord:
    """An asset that stopped before its features were known."""
    nothing: dict[str, object] = {
        "status": Status.FAILED, "failure_mode": mode, "reason": f"{code}: cannot go on", "features": None,
        "overlay": None, "measurement": None, "alignment": None, "reports": (), "overlaps": (), "calls": (),
        "trace": (),
        "findings": (make_finding(Severity.ERROR, code),), "seconds": {"extract": 0.05}, "written": False,
        "content_hash": "",
    }  # fmt: skip
    return make_record(asset_id, **(nothing | changes))


def make_finding(severity: Severity, code: str) -> Finding:
    """A finding on the link ``body``."""
    return Finding(
        stage=Stage.EXTRACT,
        severity=severity,
        code=code,
        message=f"{code}: look at it",
        link="body",
        value=2.0,
        limit=1.0,
    )


def make_run_records(count: int, failed: Sequence[FailureMode] = ()) -> list[AssetRecord]:
    """``count`` assets that passed, and one for each failure mode given."""
    passed = [make_record(f"{1000 + i}") for i in range(count)]
    return passed + [make_failure(f"bad{i}", mode) for i, mode in enumerate(failed)]


def _link_features(name: str) -> LinkFeatures:
    mesh = MeshFeatures(file=f"{name}.obj", role="visual", watertight=name == "body", flat=False, n_faces=12)
    return LinkFeatures(
        name=name, label=name, joint_kind="hinge", meshes=(mesh,), volume_m3=1e-3, volume_source=VolumeSource.HULL,
        hull_volume_m3=1e-3, area_m2=0.06, box_min=(0, 0, 0), box_max=(0.1, 0.1, 0.1), center=(0.05, 0.05, 0.05),
        unit_inertia=(1, 0, 0, 1, 0, 1), materials=(), inertial=None,
    )  # fmt: skip


def _joint_features(name: str, kind: str, parent: str, child: str) -> JointFeatures:
    return JointFeatures(
        name=name, type=kind, parent=parent, child=child, origin_xyz=(0, 0, 0), origin_rpy=(0, 0, 0), axis=(0, 0, 1),
        axis_in_root=(0, 0, 1), lower=0.0, upper=1.0, effort=None, velocity=None, damping=None, friction=None,
        mimic=None, closed=0.0, open=1.0, openness_confidence=0.9,
    )  # fmt: skip


def held(record: AssetRecord, reference: Reference | None = None, *expectations: Expectation) -> AssetRecord:
    """The record as the stage ``align`` leaves it, held against these yardsticks."""
    ref = record.ref.model_copy(update={"reference": reference, "expectations": expectations})
    record = record.model_copy(update={"ref": ref})
    unfit = () if record.features is None else misfits(record.features, expectations)
    alignment = record.alignment if expectations else align(record)
    found = {"alignment": alignment, "expected": expectations_met(record), "findings": record.findings + unfit}
    return record.model_copy(update=found)
