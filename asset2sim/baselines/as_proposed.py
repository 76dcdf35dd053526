"""A model's answer as an overlay with none of our rules: a baseline's numbers are written unchanged."""

import math

import numpy as np

from asset2sim.assets.authored import LEAST, link_of, start_of
from asset2sim.assets.extract import Extraction
from asset2sim.assets.urdf.read import Dynamics, read_dynamics
from asset2sim.physics.arrays import floats_of, inertia_terms
from asset2sim.physics.inertia import box_inertia, wall_volume
from asset2sim.physics.kinematics import mimics_of, tree_of
from asset2sim.validation.handling import handling
from asset2sim.validation.holding import HELD_STATE
from asset2sim.validation.validate import contact_friction
from schemas.base import Inertia6
from schemas.features import Features, JointFeatures, LinkFeatures
from schemas.overlay import JointPhysics, JointProposal, LinkPhysics, LinkProposal, Overlay, PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import Source


def as_proposed(extraction: Extraction, proposal: Overlay, source: Source, settings: Settings) -> PhysicsOverlay:
    """Overlay with exactly the answer's numbers: nothing is bounded, clamped, completed by rules or mended.

    Missing numbers get the engine's default as in ``authored_overlay``: authored inertials and dynamics, PyBullet's
    1 kg for a link without any, joints at zero or the nearest limit. Lengths stated by the asset (slider limits,
    centres of mass) are scaled with its shapes. Terms that only our rules turn into numbers (``coast_s``,
    ``spring_hz``, …) count as missing.
    """
    features, scale = extraction.features, proposal.scale
    links = {item.name: item for item in proposal.links}
    dynamics = read_dynamics(extraction.urdf)
    mimics = mimics_of(tree_of(features.joints, scale))
    joints = [
        joint_as_proposed(joint, features, dynamics[joint.name], proposal, source).model_copy(
            update={"mimic": mimics.get(joint.name)}
        )
        for joint in features.movable_joints
    ]
    return PhysicsOverlay(
        asset_id=features.asset_id,
        scale=scale,
        scale_source=Source.USER if "scale" in proposal.asked else source,
        contact_friction=contact_friction(proposal.contact_material, settings.physics),
        links=tuple(
            link_as_proposed(
                link,
                links.get(link.name, LinkProposal(name=link.name)),
                scale,
                source,
                Source.USER if f"links.{link.name}.mass_kg" in proposal.asked else source,
            )
            for link in features.links
        ),
        joints=tuple(joint for joint in joints if joint.mimic is None),
        followers=tuple(joint for joint in joints if joint.mimic is not None),
        notes=proposal.notes,
    )


def link_as_proposed(
    link: LinkFeatures, proposal: LinkProposal, scale: float, source: Source, mass_by: Source
) -> LinkPhysics:
    """One link: the proposed numbers, and the engine's default for the rest; ``mass_by`` is whose its mass is."""
    authored = link_of(link)
    volume = (link.volume_m3 or link.hull_volume_m3) * scale**3
    material_m3 = volume * (1.0 if proposal.hollow_factor is None else proposal.hollow_factor)
    if proposal.wall_m is not None and link.outer_m2 > 0.0:
        material_m3 = wall_volume(
            link.outer_m2 * scale**2, proposal.wall_m, link.hull_volume_m3 * scale**3, link.diagonal_m * scale
        )
    mass = proposal.mass_kg
    if mass is None and proposal.density_kg_m3 is not None and material_m3 * proposal.density_kg_m3 > 0.0:
        mass = material_m3 * proposal.density_kg_m3 + sum(item.mass_kg for item in proposal.contents)
    com = tuple(scale * value for value in authored.com) if proposal.com is None else proposal.com
    inertia, inertia_source = authored.inertia, authored.inertia_source
    if proposal.inertia is not None:
        inertia, inertia_source = proposal.inertia, source
    elif mass is not None:
        inertia = inertia_of_box(link, mass, scale)
    return authored.model_copy(
        update={
            "material": proposal.material,
            "density_kg_m3": proposal.density_kg_m3 or 0.0,
            "hollow_factor": proposal.hollow_factor or 0.0,
            "volume_m3": volume,
            "wall_m": proposal.wall_m or 0.0,
            "contents": proposal.contents,
            "mass_kg": authored.mass_kg if mass is None else mass,
            "mass_source": authored.mass_source if mass is None else mass_by,
            "com": floats_of(np.asarray(com, dtype=float)),
            "com_source": authored.com_source if proposal.com is None else source,
            "inertia": inertia,
            "inertia_source": inertia_source,
        }
    )


def inertia_of_box(link: LinkFeatures, mass: float, scale: float) -> Inertia6:
    """Inertia that PyBullet assigns to a link with a mass but no inertia, kg·m²: that of its bounding box."""
    moments = np.diag(box_inertia(mass, scale * np.asarray(link.box_size)))
    return inertia_terms(np.diag(np.maximum(moments, LEAST)))


def joint_as_proposed(
    joint: JointFeatures, features: Features, authored: Dynamics, overlay: Overlay, source: Source
) -> JointPhysics:
    """One joint: proposed damping, friction, stiffness and position, else the authored ones; limits are scaled."""
    unstated = JointProposal(name=joint.name)
    proposal = {item.name: item for item in overlay.joints}.get(joint.name, unstated)
    factor = overlay.scale if joint.prismatic else 1.0
    stated = overlay.initial_joint_positions.get(joint.name)
    position = (start_of(joint) if stated is None else stated) * factor
    user = joint.name in overlay.asked
    terms = Source.USER if any(name.startswith(f"{joint.name}.") for name in overlay.asked) else source
    lower, upper, closed, opened = (
        None if end is None else end * factor for end in (joint.lower, joint.upper, joint.closed, joint.open)
    )
    reference = authored.spring_reference if proposal.spring_rest is None else proposal.spring_rest
    return JointPhysics(
        name=joint.name,
        type=joint.type,
        label=features.link(joint.child).label,
        damping=max(authored.damping, 0.0) if proposal.damping is None else proposal.damping,
        damping_source=Source.AUTHORED if proposal.damping is None else terms,
        friction=max(authored.friction, 0.0) if proposal.friction is None else proposal.friction,
        friction_source=Source.AUTHORED if proposal.friction is None else terms,
        stiffness=max(authored.stiffness, 0.0) if proposal.stiffness is None else proposal.stiffness,
        stiffness_source=Source.AUTHORED if proposal.stiffness is None else terms,
        spring_reference=reference * factor,
        lower=lower,
        upper=upper,
        limits_source=Source.AUTHORED,
        closed=closed or 0.0,
        open=opened or 0.0,
        initial_position=position,
        position_source=Source.AUTHORED if stated is None else Source.USER if user else source,
        effective_inertia=0.0,
        gravity_load=0.0,
        asked_position=None if stated is None else position,
        effort_range=handling(features, joint, proposal).range,
        holds=must_hold(proposal, stated is not None, position, closed or 0.0, lower, upper),
    )


def must_hold(
    proposal: JointProposal, requested: bool, position: float, closed: float, lower: float | None, upper: float | None
) -> bool:
    """Whether the hold check applies to the joint: it is said to hold, or asked to stand open, as in our method. This
    changes which checks run, and no number."""
    span = 2.0 * math.pi if lower is None or upper is None else abs(upper - lower)
    is_open = abs(position - closed) > HELD_STATE * span
    return proposal.holds is True or (proposal.holds is None and requested and is_open)
