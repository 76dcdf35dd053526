"""Correct a proposal: numbers that are plainly in another unit, and, where asked for, size and state."""

import math

from asset2sim.assets.extract import Extraction
from asset2sim.models.object_facts import rounded_object_info
from asset2sim.validation.asked_state import note_out_of_reach, with_asked_state
from asset2sim.validation.link_units import convert_link_units
from asset2sim.validation.size import with_sensible_size
from schemas.features import Features, JointFeatures
from schemas.finding import Finding, Notes
from schemas.guidance import Guidance
from schemas.overlay import Overlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Correction

OUTSIDE_SHARE = 0.1
"""Share of the range outside its joint's limits from which a position is no rounding error."""
ROUNDING_SHARE = 1e-2
"""Share of the range by which a converted position may exceed the limits: degrees come as whole numbers."""
FULL_TURN_DEG = 360.0

MM_PER_M = 1000.0


def convert_misread_units(features: Features, overlay: Overlay, notes: Notes) -> Overlay:
    """The overlay with every start and spring rest converted that fits its joint's limits only as degrees or
    millimetres; a finding for each. A value within the limits as it stands is kept: its unit cannot be told."""
    joints = {joint.name: joint for joint in features.movable_joints}
    positions = {
        name: converted(joints[name], at, "position", notes) if name in joints else at
        for name, at in overlay.initial_joint_positions.items()
    }
    proposals = tuple(
        proposal.model_copy(
            update={"spring_rest": converted(joints[proposal.name], proposal.spring_rest, "spring rest", notes)}
        )
        if proposal.spring_rest is not None and proposal.name in joints
        else proposal
        for proposal in overlay.joints
    )
    if positions == overlay.initial_joint_positions and proposals == overlay.joints:
        return overlay
    return overlay.model_copy(update={"initial_joint_positions": positions, "joints": proposals})


def converted(joint: JointFeatures, at: float, what: str, notes: Notes) -> float:
    """The position in rad, or m at the authored scale."""
    instead = at / MM_PER_M if joint.prismatic else math.radians(at)
    if not misread(joint, at, instead):
        return at
    unit, right, code = ("mm", "m", "millimetres") if joint.prismatic else ("degrees", "rad", "degrees")
    message = (
        f"joint '{joint.name}': {what} {at:.4g} lies outside its limits as {right} and within them as {unit}; taken "
        f"for {unit}: {instead:.4g} {right}"
    )
    notes.warn(f"position_in_{code}", message, joint=joint.name, value=at, limit=instead)
    return instead


def misread(joint: JointFeatures, at: float, instead: float) -> bool:
    """Whether a position makes sense only in the other unit."""
    if joint.lower is None or joint.upper is None:
        # More than a whole turn is implausible in radians for a continuous joint; in degrees it may be right.
        return not joint.prismatic and 2.0 * math.pi < abs(at) <= FULL_TURN_DEG
    low, high = sorted((joint.lower, joint.upper))
    span = high - low
    if low - OUTSIDE_SHARE * span <= at <= high + OUTSIDE_SHARE * span:
        return False
    return low - ROUNDING_SHARE * span <= instead <= high + ROUNDING_SHARE * span


def sensible(
    extraction: Extraction,
    overlay: Overlay,
    guidance: Guidance,
    settings: PhysicsSettings,
    correction: Correction = Correction.SEMANTIC,
    *,
    semantics: bool = True,
) -> tuple[Overlay, tuple[Finding, ...]]:
    """The proposal corrected as far as ``correction`` says, and a finding for each change; idempotent. Without
    ``semantics`` the object's category and part names are withheld, and neither size nor state is looked at."""
    notes = Notes()
    if correction is not Correction.OFF:
        overlay = convert_link_units(extraction.features, overlay, notes)
        overlay = convert_misread_units(extraction.features, overlay, notes)
    if semantics:
        info = rounded_object_info(extraction.features)
        if correction is not Correction.OFF and (correction is Correction.SEMANTIC or info.lengths):
            overlay = with_sensible_size(info, guidance, overlay, notes)
        if correction is Correction.SEMANTIC:
            overlay = with_asked_state(info, guidance, overlay, settings, notes)
        note_out_of_reach(info, guidance, overlay.scale, notes)
    return overlay, tuple(notes.findings)
