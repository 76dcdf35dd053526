"""The offline model's answer for methods that use a model's numbers unchanged: masses, inertias and joint terms. From
the same tables as its other answers, with the paper's absolute ranges in place of times and frequencies."""

import numpy as np

from asset2sim.guidance.object_info import LinkInfo, ObjectInfo
from asset2sim.models.prior.link_proposals import TINY_KG, link_mass
from asset2sim.physics.arrays import inertia_terms
from asset2sim.physics.inertia import box_inertia
from asset2sim.physics.paper_ranges import paper_terms
from schemas.overlay import JointProposal, LinkProposal, Overlay
from schemas.vocabulary import Source

BARE_KG = TINY_KG[1]
"""Mass of a link without a shape, kg: the most that the paper gives a tiny part."""
LEAST_EDGE_M = 0.002
"""Edge that a sheet, or a link without a shape, is given for its inertia, m."""
DIGITS = 4
"""Significant digits of its numbers."""
SCALE_SIGMA = 0.2
"""Relative standard deviation of a size guessed from a category ..."""
MASS_SIGMA = 0.3
"""... of a mass guessed from a volume, a material and a hollow factor ..."""
INERTIA_SIGMA = 0.5
"""... of an inertia, which squares the size ..."""
TERM_SIGMA = 0.5
"""... of a joint term from a range that spans a decade ..."""
STATE_SIGMA = 0.1
"""... and of a position, as a share of the joint's range."""
ANY_RANGE = 1.0
"""Range assumed for a joint without one, rad."""


def final_overlay(info: ObjectInfo, felt: Overlay, with_sigmas: bool = False) -> Overlay:
    """The prior's overlay ``felt`` in final numbers, for every link, also one without a shape. Masses are as built,
    inertias those of boxes, joint triplets absolute. ``with_sigmas`` adds the standard deviation of every number that
    is not zero: constant relative ones, since a table does not know where it errs."""
    materials = {link.name: link for link in felt.links}
    proposal = felt.model_copy(
        update={
            "links": tuple(final_link(link, materials.get(link.name), felt.scale) for link in info.links),
            "joints": tuple(final_joint(info, joint, felt) for joint in felt.joints),
            "mass_change": None,
        }
    )
    return proposal.model_copy(update={"sigmas": sigmas_of(info, proposal)}) if with_sigmas else proposal


def with_sigmas(info: ObjectInfo, felt: Overlay) -> Overlay:
    """``final_overlay`` with standard deviations."""
    return final_overlay(info, felt, True)


def final_link(link: LinkInfo, felt: LinkProposal | None, scale: float) -> LinkProposal:
    """Mass (kg) and box inertia (kg·m²) of one link at the final scale."""
    mass = BARE_KG
    if felt is not None and felt.density_kg_m3 is not None:
        mass = link_mass(link, felt, scale)
    mass = four_digits(mass) or BARE_KG
    edges = np.maximum(scale * np.asarray(link.box_m), LEAST_EDGE_M)
    inertia = np.diag([four_digits(moment) for moment in np.diag(box_inertia(mass, edges))])
    return LinkProposal(
        name=link.name, material=None if felt is None else felt.material, mass_kg=mass, inertia=inertia_terms(inertia)
    )


def final_joint(info: ObjectInfo, felt: JointProposal, overlay: Overlay) -> JointProposal:
    """Damping, friction and stiffness of one joint, from the paper's ranges."""
    prismatic = next(joint.type == "prismatic" for joint in info.joints if joint.name == felt.name)
    holds = felt.holds is True or felt.name in overlay.initial_joint_positions
    terms = paper_terms(felt, prismatic=prismatic, holds=holds, rest=felt.spring_rest or 0.0, source=Source.PRIOR)
    return JointProposal(
        name=felt.name,
        damping=four_digits(terms.damping.value),
        friction=four_digits(terms.friction.value),
        stiffness=four_digits(terms.stiffness.value),
        spring_rest=felt.spring_rest if terms.stiffness.value > 0.0 else None,
        holds=felt.holds,
    )


def sigmas_of(info: ObjectInfo, proposal: Overlay) -> dict[str, float]:
    """Path → standard deviation, in the number's unit, of every number that is not zero."""
    ranges = {joint.name: joint.range or ANY_RANGE for joint in info.joints}
    found = {"scale": SCALE_SIGMA * proposal.scale}
    for link in proposal.links:
        found[f"links.{link.name}.mass_kg"] = MASS_SIGMA * (link.mass_kg or 0.0)
        found[f"links.{link.name}.inertia"] = INERTIA_SIGMA * max(link.inertia or (0.0,))
    for joint in proposal.joints:
        for term in ("damping", "friction", "stiffness"):
            found[f"joints.{joint.name}.{term}"] = TERM_SIGMA * (getattr(joint, term) or 0.0)
        if joint.spring_rest is not None:
            found[f"joints.{joint.name}.spring_rest"] = STATE_SIGMA * ranges[joint.name]
    for name in proposal.initial_joint_positions:
        found[f"initial_joint_positions.{name}"] = STATE_SIGMA * ranges[name]
    return {path: four_digits(sigma) for path, sigma in found.items() if sigma > 0.0}


def four_digits(value: float) -> float:
    """The number rounded to ``DIGITS``."""
    return float(f"{value:.{DIGITS}g}")
