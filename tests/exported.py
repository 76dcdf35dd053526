"""Small refined folders for the tests of exports: a URDF with its overlay, every number known."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from asset2sim.assets.folder import URDF_NAME
from schemas.overlay import JointPhysics, LinkPhysics, PhysicsOverlay
from schemas.vocabulary import Source, VolumeSource
from tests.builders import ORIGIN, UrdfJoint, UrdfLink, ball_inertia, bias_of, box, write_urdf

FRICTION = 0.45
BASE = UrdfLink("base", mass=10.0, inertia=ball_inertia(1.0), shapes=((box(0.2, 0.2, 0.1), ORIGIN),))
ARM = UrdfLink("arm", mass=0.5, com=(0.1, 0.0, 0.0), inertia=(2e-4, 0.0, 0.0, 3e-4, 0.0, 4e-4))
ARM_INERTIA = 4e-4 + 0.5 * 0.1**2
"""Inertia of ``ARM`` about z through its link's origin, kg·m²."""


def refined(
    folder: Path, links: Sequence[UrdfLink], joints: Sequence[UrdfJoint], initial: Mapping[str, float] | None = None
) -> PhysicsOverlay:
    """Write a refined folder with this URDF, and return its overlay; joints not named start at zero."""
    write_urdf(folder, links, joints).rename(folder / URDF_NAME)
    overlay = PhysicsOverlay(
        asset_id="object",
        scale=1.0,
        scale_source=Source.USER,
        contact_friction=FRICTION,
        links=tuple(_link(link) for link in links),
        joints=tuple(_joint(joint, (initial or {}).get(joint.name, 0.0)) for joint in joints if joint.type != "fixed"),
    )
    (folder / "overlay.json").write_text(overlay.model_dump_json(), encoding="utf-8")
    return overlay


def arm(folder: Path, initial: float = 0.0, **joint: object) -> PhysicsOverlay:
    """``ARM`` on a vertical hinge ``j`` over ``BASE``: gravity does nothing to it; ``joint``: its fields."""
    fields: dict[str, object] = {"name": "j", "type": "revolute", "parent": "base", "child": "arm", "xyz": (0, 0, 0.1)}
    return refined(folder, [BASE, ARM], [UrdfJoint(**(fields | joint))], {"j": initial})  # type: ignore[arg-type]


def _link(link: UrdfLink) -> LinkPhysics:
    return LinkPhysics(
        name=link.name, label="", material=None, density_kg_m3=0.0, hollow_factor=0.0, volume_m3=0.0,
        volume_source=VolumeSource.NONE, mass_kg=link.mass, mass_source=Source.RULE, com=link.com,
        com_source=Source.RULE, inertia=link.inertia, inertia_source=Source.RULE,
    )  # fmt: skip


def _joint(joint: UrdfJoint, initial: float) -> JointPhysics:
    return JointPhysics(
        name=joint.name, type=joint.type, label="", damping=joint.damping, damping_source=Source.RULE,
        friction=joint.friction, friction_source=Source.RULE, stiffness=joint.stiffness, stiffness_source=Source.RULE,
        spring_reference=joint.reference, lower=joint.lower, upper=joint.upper, limits_source=Source.AUTHORED,
        closed=joint.lower, open=joint.upper, initial_position=initial, position_source=Source.USER,
        effective_inertia=0.0, gravity_load=0.0, holds=False,
        bias=bias_of(joint),
    )  # fmt: skip
