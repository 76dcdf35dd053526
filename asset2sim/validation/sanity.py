"""Correct a proposal: numbers that are plainly in another unit, and, where asked for, size and state."""

import math

from asset2sim.assets.extract import Extraction
from asset2sim.models.object_facts import rounded_object_info
from asset2sim.validation.asked_state import note_out_of_reach, with_asked_state
from asset2sim.validation.size import with_sensible_size
from schemas.features import Features, JointFeatures, LinkFeatures
from schemas.finding import Finding, Notes
from schemas.guidance import Guidance
from schemas.overlay import LinkProposal, Overlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Correction

OUTSIDE_SHARE = 0.1
"""Share of the range outside its joint's limits from which a position is no rounding error."""
ROUNDING_SHARE = 1e-2
"""Share of the range by which a converted position may exceed the limits: degrees come as whole numbers."""
FULL_TURN_DEG = 360.0

LEAST_DENSITY_KG_M3 = 10.0
"""Density below which a number is none in kg/m³: foamed plastics have 10 and more, and solids in g/cm³ up to 9."""
KG_M3_PER_G_CM3 = 1000.0
THICKEST_M = 0.1
"""Wall from which on a number is none in metres, where the whole link is thinner ..."""
THINNEST_M = 1e-4
"""... and that of a foil, which a wall has at least."""
MM_PER_M = 1000.0


def convert_link_units(features: Features, overlay: Overlay, notes: Notes) -> Overlay:
    """The overlay with every density and wall converted that can only be in g/cm³ or millimetres; a finding for each.
    What may be either is kept: its unit cannot be told."""
    links = {link.name: link for link in features.links}
    proposals = tuple(
        converted_link(item, links[item.name], overlay.scale, notes) if item.name in links else item
        for item in overlay.links
    )
    return overlay if proposals == overlay.links else overlay.model_copy(update={"links": proposals})


def converted_link(item: LinkProposal, link: LinkFeatures, scale: float, notes: Notes) -> LinkProposal:
    """One link's proposal with its density in kg/m³ and its wall in m."""
    changes: dict[str, float] = {}
    density, wall = item.density_kg_m3, item.wall_m
    if density is not None and density < LEAST_DENSITY_KG_M3:
        right = density * KG_M3_PER_G_CM3
        changes["density_kg_m3"] = right
        message = f"link '{item.name}': no solid has {density:.4g} kg/m³; taken for g/cm³: {right:.4g} kg/m³"
        notes.warn("density_in_g_cm3", message, link=item.name, value=density, limit=right)
    thinnest = min(link.box_size) * scale
    if wall is not None and wall > max(THICKEST_M, thinnest) and wall / MM_PER_M >= THINNEST_M:
        changes["wall_m"] = wall / MM_PER_M
        message = (
            f"link '{item.name}': a wall of {wall:.4g} m is thicker than the link ({thinnest:.3g} m); taken for "
            f"millimetres: {changes['wall_m']:.4g} m"
        )
        notes.warn("wall_in_millimetres", message, link=item.name, value=wall, limit=changes["wall_m"])
    return item.model_copy(update=changes)


def convert_misread_units(features: Features, overlay: Overlay, notes: Notes) -> Overlay:
    """The overlay with every start and spring rest converted that fits its joint's limits only as degrees or
    millimetres; a finding for each. A value within the limits as it stands is kept: its unit cannot be told."""
    joints = {joint.name: joint for joint in features.movable_joints}
    positions = {
        name: position_in_metres(joints[name], at, "position", notes) if name in joints else at
        for name, at in overlay.initial_joint_positions.items()
    }
    proposals = tuple(
        proposal.model_copy(
            update={
                "spring_rest": position_in_metres(joints[proposal.name], proposal.spring_rest, "spring rest", notes)
            }
        )
        if proposal.spring_rest is not None and proposal.name in joints
        else proposal
        for proposal in overlay.joints
    )
    if positions == overlay.initial_joint_positions and proposals == overlay.joints:
        return overlay
    return overlay.model_copy(update={"initial_joint_positions": positions, "joints": proposals})


def position_in_metres(joint: JointFeatures, at: float, what: str, notes: Notes) -> float:
    """The position in rad, or m at the authored scale."""
    instead = at / MM_PER_M if joint.prismatic else math.radians(at)
    if not is_other_unit(joint, at, instead):
        return at
    unit, right, code = ("mm", "m", "millimetres") if joint.prismatic else ("degrees", "rad", "degrees")
    message = (
        f"joint '{joint.name}': {what} {at:.4g} lies outside its limits as {right} and within them as {unit}; taken "
        f"for {unit}: {instead:.4g} {right}"
    )
    notes.warn(f"position_in_{code}", message, joint=joint.name, value=at, limit=instead)
    return instead


def is_other_unit(joint: JointFeatures, at: float, instead: float) -> bool:
    """Whether a position makes sense only in the other unit."""
    if joint.lower is None or joint.upper is None:
        # More than a whole turn is implausible in radians for a continuous joint; in degrees it may be right.
        return not joint.prismatic and 2.0 * math.pi < abs(at) <= FULL_TURN_DEG
    low, high = sorted((joint.lower, joint.upper))
    span = high - low
    if low - OUTSIDE_SHARE * span <= at <= high + OUTSIDE_SHARE * span:
        return False
    return low - ROUNDING_SHARE * span <= instead <= high + ROUNDING_SHARE * span


def corrected_proposal(
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
