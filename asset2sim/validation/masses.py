"""Masses, centres and inertias, completed for every link and bounded so that engines take them."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.linalg import LinAlgError

from asset2sim.intake.authored_numbers import BOX_MARGIN
from asset2sim.physics.arrays import Array
from asset2sim.physics.inertia import PhysicalTensor, make_physical, plate_volume, tensor_of
from asset2sim.physics.kinematics import link_to_root, origin_transform, tree_of
from asset2sim.physics.mass_matrix import JointSpace
from asset2sim.validation.build import NOTHING_BUILT, Built, built_link
from schemas.base import Vector3
from schemas.errors import AssetError
from schemas.features import Features, LinkFeatures, LinkInertial
from schemas.finding import Notes
from schemas.overlay import LinkProposal
from schemas.settings import PhysicsSettings
from schemas.vocabulary import FailureMode, MassRule, Quantity, Source


@dataclass(frozen=True)
class LinkMass:
    """One link's mass properties at the final scale, (3,) centre and (3, 3) inertia about it in the link's frame."""

    name: str
    made: Built
    rule: MassRule
    mass: float
    mass_source: Source
    com: Array
    com_source: Source
    inertia: Array
    inertia_source: Source


def link_masses(
    features: Features,
    proposals: Mapping[str, LinkProposal],
    scale: float,
    source: Source,
    settings: PhysicsSettings,
    notes: Notes,
    theirs: Collection[str] = (),
    kept: Mapping[str, Collection[Quantity]] = MappingProxyType({}),
) -> dict[str, LinkMass]:
    """Mass properties of every link; links without geometry take a share of their neighbour's, where the mass of their
    file is not ``kept`` or masses are the user's. ``theirs`` names the links whose proposed masses are the user's;
    ``kept`` what of the file goes before a proposal, by link."""
    solid = [link for link in features.links if link.has_geometry]
    at_rest = link_to_root(tree_of(features.joints), features.root, {})
    masses = {
        link.name: link_mass(
            link,
            proposals.get(link.name),
            scale,
            source,
            settings,
            notes,
            at_rest[link.name][:3, :3],
            features.link_boxes.get(link.name),
            foot=features.link_feet.get(link.name),
            mass_by=Source.USER if link.name in theirs else source,
            kept=() if link.name in theirs else kept.get(link.name, ()),
        )
        for link in solid
    }
    # The furthest from the root first: what carries a light part in steps takes from that, and not from the body.
    parents = {joint.child: joint.parent for joint in features.joints}
    for link in sorted(features.links, key=lambda link: -steps_from_root(link.name, parents)):
        if not link.has_geometry and link.inertial and Quantity.MASS in kept.get(link.name, ()) and not theirs:
            masses |= {link.name: stated_lump(link.name, link.inertial, scale)}
        elif not link.has_geometry:
            masses = share_mass(link, masses, features, scale, settings, notes)
    masses = bound_ratio(masses, features, scale, settings, notes)
    return {link.name: with_possible_inertia(masses[link.name], settings, notes) for link in features.links}


def link_mass(
    link: LinkFeatures,
    proposal: LinkProposal | None,
    scale: float,
    source: Source,
    settings: PhysicsSettings,
    notes: Notes,
    to_root: Array | None = None,
    upright_m: Vector3 | None = None,
    foot: tuple[float, float] | None = None,
    mass_by: Source | None = None,
    kept: Collection[Quantity] = (),
) -> LinkMass:
    """Mass properties of one link with geometry; missing values come from the URDF, else from a fallback material.
    ``to_root`` is the (3, 3) rotation into the root link's frame at rest, ``upright_m`` the edges of the link's box
    there, by which contents are placed, and ``foot`` the middle of its foot in it; ``mass_by`` is whose the proposed
    mass is, if not of ``source``; what is ``kept`` of the file goes before the proposal's."""
    if Quantity.MASS in kept and link.inertial is not None:
        proposal = proposal or LinkProposal(name=link.name)
        proposal = proposal.model_copy(update={"mass_kg": link.inertial.mass_kg, "com": None, "inertia": None})
        mass_by = Source.AUTHORED
    made = built_link(link, proposal, scale, settings, np.eye(3) if to_root is None else to_root, upright_m, foot)
    mass, rule, mass_source = made.mass, made.rule, Source.RULE
    if proposal is not None and (proposal.density_kg_m3 is not None or proposal.mass_kg is not None):
        mass_source = mass_by or source
    if proposal is not None and proposal.mass_kg is not None:
        mass, rule = proposal.mass_kg, MassRule.STATED
    elif mass_source is Source.RULE and link.inertial is not None and link.inertial.mass_kg > settings.min_mass_kg:
        mass, rule, mass_source = link.inertial.mass_kg, MassRule.STATED, Source.AUTHORED
    if mass_source is Source.RULE:
        message = f"link '{link.name}': the overlay states no material or mass; {mass:.4g} kg assumed"
        notes.info("link_completed", message, link=link.name, value=mass)
    thickest = plate_volume(link.outer_m2, link.diagonal_m)
    densest = settings.max_density_kg_m3 * max(link.volume_m3, link.hull_volume_m3, thickest) * scale**3
    if mass > densest:
        message = f"link '{link.name}': {mass:.3g} kg would be denser than any material; set to {densest:.3g} kg"
        notes.warn("mass_implausible", message, link=link.name, value=mass, limit=densest)
        mass, rule, mass_source = densest, MassRule.BOUNDED, Source.RULE
    least = least_mass(settings.min_mass_kg, link, scale, settings)
    if mass < least:
        message = f"link '{link.name}': mass {mass:.3g} kg raised to the least that engines handle"
        notes.info("mass_raised", message, link=link.name, value=mass, limit=least)
        mass, rule, mass_source = least, MassRule.BOUNDED, Source.RULE
    inertia = mass * made.unit_inertia
    result = LinkMass(link.name, made, rule, mass, mass_source, made.com, Source.RULE, inertia, Source.RULE)
    if link.inertial is not None and Quantity.CENTRE in kept:
        result = replace(result, com=scale * np.asarray(link.inertial.com), com_source=Source.AUTHORED)
    if link.inertial is not None and Quantity.INERTIA in kept:
        stated = scale**2 * mass / link.inertial.mass_kg * tensor_of(link.inertial.inertia)
        result = replace(result, inertia=stated, inertia_source=Source.AUTHORED)
    return result if proposal is None else with_proposed_inertia(result, link, proposal, scale, source, settings, notes)


def least_mass(least: float, link: LinkFeatures, scale: float, settings: PhysicsSettings) -> float:
    """Minimum mass of a link, kg: ``least``, or less where its volume would then be denser than any material."""
    volume = max(link.volume_m3, link.hull_volume_m3) * scale**3
    if volume <= 0.0:
        return least
    smallest = min(settings.smallest_mass_kg, settings.max_density_kg_m3 * volume)
    return max(min(least, settings.raised_density_kg_m3 * volume), smallest)


def with_proposed_inertia(
    result: LinkMass,
    link: LinkFeatures,
    proposal: LinkProposal,
    scale: float,
    source: Source,
    settings: PhysicsSettings,
    notes: Notes,
) -> LinkMass:
    """The link with the proposed centre of mass and inertia, each only where it is near what the shape gives."""
    if proposal.com is not None:
        low, high = np.asarray(link.box_min) * scale, np.asarray(link.box_max) * scale
        margin = BOX_MARGIN * (high - low)
        com = np.asarray(proposal.com)
        if np.all(com >= low - margin) and np.all(com <= high + margin):
            result = replace(result, com=com, com_source=source)
        else:
            message = f"link '{link.name}': the proposed centre of mass lies outside the link; its shape's is used"
            notes.warn("com_outside", message, link=link.name)
    if proposal.inertia is not None:
        inertia = tensor_of(proposal.inertia)
        ratio = float(np.trace(inertia)) / max(float(np.trace(result.inertia)), 1e-12)
        if 1.0 / settings.inertia_factor <= ratio <= settings.inertia_factor:
            result = replace(result, inertia=inertia, inertia_source=source)
        else:
            message = (
                f"link '{link.name}': the proposed inertia is {ratio:.3g} times what its shape and mass give; the "
                "shape's is used"
            )
            notes.warn("inertia_implausible", message, link=link.name, value=ratio, limit=settings.inertia_factor)
    return result


def bound_ratio(
    masses: dict[str, LinkMass], features: Features, scale: float, settings: PhysicsSettings, notes: Notes
) -> dict[str, LinkMass]:
    """Raise the lightest links that others hang from until the heaviest is at most ``max_mass_ratio`` times as heavy,
    and none too light. A part at the end of the tree (key, button, knob) keeps its mass: solvers are exact over the
    tree, and springs get an armature. No link becomes denser than any material."""
    heaviest = max((item.mass for item in masses.values()), default=0.0)
    carriers = {joint.parent for joint in features.joints}
    bounded = {}
    for name, item in masses.items():
        wanted = heaviest / settings.max_mass_ratio if name in carriers else 0.0
        least = least_mass(max(wanted, settings.min_mass_kg), features.link(name), scale, settings)
        if item.mass < least:
            message = f"link '{name}': mass raised from {item.mass:.3g} to {least:.3g} kg, a share engines handle"
            notes.info("mass_ratio", message, link=name, value=item.mass, limit=least)
            factor = least / item.mass
            raised = replace(item, mass=least, mass_source=Source.RULE, inertia=item.inertia * factor)
            item = replace(raised, rule=MassRule.BOUNDED, inertia_source=Source.RULE)
        bounded[name] = item
    return bounded


def steps_from_root(name: str, parents: Mapping[str, str]) -> int:
    """The number of joints between a link and its root, by the parent of each link that has one."""
    steps = 0
    while name in parents:
        name, steps = parents[name], steps + 1
    return steps


def stated_lump(name: str, stated: LinkInertial, scale: float) -> LinkMass:
    """Mass properties of a link without geometry as its file states them."""
    com, inertia = scale * np.asarray(stated.com), scale**2 * tensor_of(stated.inertia)
    of_file = (stated.mass_kg, Source.AUTHORED, com, Source.AUTHORED, inertia, Source.AUTHORED)
    return LinkMass(name, NOTHING_BUILT, MassRule.STATED, *of_file)


def share_mass(
    link: LinkFeatures,
    masses: dict[str, LinkMass],
    features: Features,
    scale: float,
    settings: PhysicsSettings,
    notes: Notes,
) -> dict[str, LinkMass]:
    """Give a link without geometry a share of its child's mass (else its parent's); the total is unchanged. Both keep
    the donor's centre of mass, and inertia in proportion. Without this an engine would invent 1 kg for it."""
    neighbours = [(joint.child, joint) for joint in features.joints if joint.parent == link.name]
    neighbours.sort(key=lambda item: (item[1].type != "fixed", -masses[item[0]].mass if item[0] in masses else 0.0))
    neighbours += [(joint.parent, joint) for joint in features.joints if joint.child == link.name]
    found = next(((name, joint) for name, joint in neighbours if name in masses), None)
    of_nothing = (link.name, NOTHING_BUILT, MassRule.SHARED)
    if found is None:
        tiny = settings.min_mass_kg
        inertia = np.eye(3) * tiny * settings.min_half_extent_m**2
        alone = LinkMass(*of_nothing, tiny, Source.RULE, np.zeros(3), Source.RULE, inertia, Source.RULE)
        return {**masses, link.name: alone}
    name, joint = found
    donor = masses[name]
    share = settings.kept_massless_share if donor.mass_source is Source.AUTHORED else settings.massless_share
    pose = origin_transform([scale * value for value in joint.origin_xyz], joint.origin_rpy)
    if joint.child == link.name:
        pose = np.asarray(np.linalg.inv(pose), dtype=np.float64)
    rotation = pose[:3, :3]
    com, inertia = rotation @ donor.com + pose[:3, 3], share * rotation @ donor.inertia @ rotation.T
    taken = LinkMass(*of_nothing, share * donor.mass, Source.RULE, com, Source.RULE, inertia, Source.RULE)
    kept = replace(donor, mass=(1.0 - share) * donor.mass, inertia=(1.0 - share) * donor.inertia)
    message = (
        f"link '{link.name}' has no geometry: it takes {share:.0%} of the mass of '{name}', whose centre it shares, "
        "so that no engine invents a mass for it"
    )
    notes.info("massless_link", message, link=link.name, value=taken.mass)
    return {**masses, name: kept, link.name: taken}


def with_possible_inertia(item: LinkMass, settings: PhysicsSettings, notes: Notes) -> LinkMass:
    """The link with a physically possible inertia, at least that of a cube of half edge ``min_half_extent_m``."""
    smallest = max(settings.min_inertia_kg_m2, item.mass * settings.min_half_extent_m**2 * 2.0 / 3.0)
    mended: PhysicalTensor = make_physical(item.inertia, smallest)
    for change in mended.changes:
        notes.info("inertia_mended", f"link '{item.name}': {change}", link=item.name)
    # A hair that engines need at a flat plate changes no number.
    same = np.allclose(mended.tensor, item.inertia, rtol=0.0, atol=1e-3 * float(np.trace(mended.tensor)))
    return replace(item, inertia=mended.tensor, inertia_source=item.inertia_source if same else Source.RULE)


def check_mass_matrices(features: Features, spaces: Sequence[JointSpace]) -> None:
    """Refuse an object whose lengths lie too far apart for numbers. Raises AssetError, with the largest link."""
    try:
        for space in spaces:
            space.mobility  # noqa: B018 - computed once, and kept
    except LinAlgError as error:
        far, link = max((max(map(abs, (*link.box_min, *link.box_max))), link.name) for link in features.links)
        message = (
            f"its mass matrix has no inverse: link '{link}' reaches {far:.3g} m from its origin; mend origins, scales"
        )
        mode = FailureMode.INVALID_JOINT_CONFIGURATION
        raise AssetError(mode, "mass_matrix_singular", message, link=link) from error
