"""The authored asset as an overlay: the values of its URDF, and PyBullet's defaults where it states none; and the
overlay that lies beside a refined one."""

from pathlib import Path

import numpy as np

from asset2sim.assets.extract import Extraction
from asset2sim.assets.urdf.read import read_dynamics
from schemas.features import JointFeatures, LinkFeatures
from schemas.overlay import JointPhysics, LinkPhysics, PhysicsOverlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source

ENGINE_MASS_KG = 1.0
"""Mass that PyBullet gives a link whose URDF states none, kg ..."""
ENGINE_INERTIA = (1.0, 0.0, 0.0, 1.0, 0.0, 1.0)
"""... and its inertia, kg·m²."""
CLOSED_SHARE = 0.02
"""Share of its range from its closed end within which a joint counts as closed."""
REFINED_NAME = "overlay.json"
"""File of a refined folder with the overlay that was written."""
OF_THE_STATE = ("initial_position", "asked_position", "position_source", "holds", "closed", "open", "effort_range",
                "effective_inertia", "gravity_load", "least_inertia")  # fmt: skip
"""Of a joint in it, what no URDF says."""
LEAST = 1e-9
"""Least mass that is recorded, kg: a record may not hold a mass of zero."""


def read_overlay(folder: Path) -> PhysicsOverlay:
    """The overlay of a refined folder. Raises OSError where it has none, ValueError for one that is damaged."""
    return PhysicsOverlay.model_validate_json((folder / REFINED_NAME).read_bytes())


def authored_overlay(extraction: Extraction, settings: PhysicsSettings, *, asked: bool = False) -> PhysicsOverlay:
    """The overlay that changes nothing: scale 1, inertials and dynamics as authored, joints at zero or their limit.
    ``asked``: every joint that this leaves closed is asked to stay so, by which the state check judges it."""
    features = extraction.features
    dynamics = read_dynamics(extraction.urdf)
    joints = tuple(
        JointPhysics(
            name=joint.name,
            type=joint.type,
            label=features.link(joint.child).label,
            damping=max(dynamics[joint.name].damping, 0.0),
            damping_source=Source.AUTHORED,
            friction=max(dynamics[joint.name].friction, 0.0),
            friction_source=Source.AUTHORED,
            stiffness=max(dynamics[joint.name].stiffness, 0.0),
            stiffness_source=Source.AUTHORED,
            spring_reference=dynamics[joint.name].spring_reference,
            lower=joint.lower,
            upper=joint.upper,
            limits_source=Source.AUTHORED,
            closed=joint.closed,
            open=joint.open,
            initial_position=start_of(joint),
            position_source=Source.AUTHORED,
            effective_inertia=0.0,
            gravity_load=0.0,
            holds=False,
            asked_position=start_of(joint) if asked and starts_closed(joint) else None,
            armature=max(dynamics[joint.name].armature, 0.0),
            mimic=joint.mimic,
        )
        for joint in features.movable_joints
    )
    return PhysicsOverlay(
        asset_id=features.asset_id,
        scale=1.0,
        scale_source=Source.AUTHORED,
        contact_friction=settings.contact_friction,
        links=tuple(link_of(link) for link in features.links),
        joints=tuple(joint for joint in joints if joint.mimic is None),
        followers=tuple(joint for joint in joints if joint.mimic is not None),
    )


def with_refined_state(authored: PhysicsOverlay, refined: PhysicsOverlay) -> tuple[PhysicsOverlay, tuple[str, ...]]:
    """The overlay of a refined URDF as it is now, with what ``overlay.json`` adds that a URDF cannot say: where joints
    start and what is asked of them, friction and support; and in words what of it the URDF does not have."""
    known = {joint.name: joint for joint in refined.all_joints}

    def stated(joint: JointPhysics) -> JointPhysics:
        return joint.model_copy(update={name: getattr(known[joint.name], name) for name in OF_THE_STATE})

    whole = {
        name: getattr(refined, name) for name in ("contact_friction", "rolling_friction_m", "turned_rad", "support")
    }
    joints = {
        kind: tuple(stated(joint) if joint.name in known else joint for joint in getattr(authored, kind))
        for kind in ("joints", "followers")
    }
    left = known.keys() - {joint.name for joint in authored.all_joints}
    unknown = tuple(
        f"{REFINED_NAME} states joint '{name}', which the URDF does not have or fixes" for name in sorted(left)
    )
    return authored.model_copy(update=whole | joints), unknown


def start_of(joint: JointFeatures) -> float:
    """Zero, or the limit nearest to it."""
    if joint.lower is None or joint.upper is None or joint.lower > joint.upper:
        return 0.0
    return float(np.clip(0.0, joint.lower, joint.upper))


def starts_closed(joint: JointFeatures) -> bool:
    """Whether the joint has limits and starts at its closed end."""
    if joint.lower is None or joint.upper is None or joint.closed is None:
        return False
    return abs(start_of(joint) - joint.closed) <= CLOSED_SHARE * abs(joint.upper - joint.lower)


def link_of(link: LinkFeatures) -> LinkPhysics:
    """A link with its authored inertial, or PyBullet's default."""
    inertial = link.inertial
    return LinkPhysics(
        name=link.name,
        label=link.label,
        material=None,
        density_kg_m3=0.0,
        hollow_factor=0.0,
        volume_m3=link.volume_m3,
        volume_source=link.volume_source,
        mass_kg=ENGINE_MASS_KG if inertial is None else max(inertial.mass_kg, LEAST),
        mass_source=Source.AUTHORED,
        com=(0.0, 0.0, 0.0) if inertial is None else inertial.com,
        com_source=Source.AUTHORED,
        inertia=ENGINE_INERTIA if inertial is None else inertial.inertia,
        inertia_source=Source.AUTHORED,
    )
