"""Damping, friction and springs by rules where a check fails with those that the asset's file states."""

from collections.abc import Sequence

from asset2sim.refinement.context import RefinementContext
from schemas.overlay import PhysicsOverlay
from schemas.verdict import Failure
from schemas.vocabulary import Source

SOURCED = ("damping", "friction", "stiffness")
TERMS = (*SOURCED, *(f"{term}_source" for term in SOURCED), "spring_reference", "armature", "bias",
         "holds", "initial_position", "position_source", "asked_position")  # fmt: skip
"""Fields of a joint that its file's dynamics decide: where it starts, too, since a spring brings it there."""


def with_supplied_terms(
    loop: RefinementContext, overlay: PhysicsOverlay, failed: Sequence[Failure]
) -> PhysicsOverlay | None:
    """The overlay with terms by rules where a file's are kept: of the joints that fail, or of all where
    no failure names one; None where none is kept."""
    names = {failure.subject for failure in failed} & {joint.name for joint in overlay.joints}
    kept = {
        joint.name
        for joint in overlay.joints
        if (not names or joint.name in names)
        and any(getattr(joint, f"{term}_source") is Source.AUTHORED for term in SOURCED)
    }
    if not overlay.authored or not kept:
        return None
    placed = {
        joint.name: joint.initial_position
        for joint in overlay.joints
        if joint.name not in kept or joint.position_source is Source.SEARCH
    }
    made = loop.validated_at(overlay, placed, keep_terms=False)
    ours = {joint.name: {name: getattr(joint, name) for name in TERMS} for joint in made.joints}
    joints = (joint.model_copy(update=ours[joint.name]) if joint.name in kept else joint for joint in overlay.joints)
    return overlay.model_copy(update={"joints": tuple(joints)})
