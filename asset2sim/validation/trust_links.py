"""Belief in what a file in metres says of its links: masses, centres of mass and inertias. Pure."""

from collections.abc import Collection, Mapping, Sequence
from functools import partial

import numpy as np

from asset2sim.assets.metric import (
    LEAST_DENSITY_KG_M3,
    LEAST_MATERIAL_KG_M3,
    MOST_DENSITY_KG_M3,
    authored_density,
    is_plate_of_nothing,
    placeholders,
)
from asset2sim.guidance.parts import part_name
from asset2sim.intake.authored_numbers import BOX_MARGIN, TRIANGLE_SLACK
from asset2sim.physics.arrays import Array
from asset2sim.physics.inertia import tensor_of
from asset2sim.validation.build import built_link
from asset2sim.validation.trust import Opinion, doubtful_belief, impossible_belief
from schemas.authored import Belief
from schemas.features import Features, LinkFeatures, LinkInertial
from schemas.overlay import LinkProposal
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Quantity, Trust

ALONE = Belief(trust=Trust.DOUBTFUL, reason="the mass that it belongs to is not believed")
PLAUSIBLE_MASS = Belief(
    trust=Trust.PLAUSIBLE,
    reason=f"{LEAST_DENSITY_KG_M3:g} to {MOST_DENSITY_KG_M3:g} kg/m³ over its hull, as bodies have",
)
LUMP = Belief(
    trust=Trust.PLAUSIBLE,
    reason="it has no geometry, is no heavier than a part that it is joined to, and lies within the object",
)
LEAVES = frozenset(("door", "drawer", "lid"))
"""Parts that all makers build alike, of sheet or board, so that what a proposal builds tells what they weigh."""


def judge_links(
    opinion: Opinion,
    features: Features,
    proposals: Mapping[str, LinkProposal],
    settings: PhysicsSettings,
    least_share: float = 0.0,
) -> None:
    """Add how far the masses, centres and inertias of an object are believed, beside ``proposals`` for its links, of
    whose mass the stated ones have together ``least_share`` or more."""
    tied = {joint.child for joint in features.joints if joint.mimic is not None}
    joints = {joint.child: joint.name for joint in features.movable_joints}
    parts = {link.name: part_name(link.label, link.name, joints.get(link.name, "")) for link in features.links}
    leaves = {name for name, part in parts.items() if part in LEAVES and name in joints} - tied
    found = stated_masses(features, tied, leaves, proposals, settings)
    large = [link for link in features.links if link.name not in tied and parts[link.name] in ("", *LEAVES)]
    found |= judged_whole(large, found, proposals, settings, least_share)
    # Links without geometry last: they are believed beside others.
    for link in sorted(features.links, key=lambda link: not link.has_geometry):
        if link.inertial is None:
            continue
        if not link.has_geometry:
            lump = judged_lump(link.inertial, heaviest_neighbour(link.name, opinion, features), features)
            for quantity in (Quantity.MASS, Quantity.CENTRE, Quantity.INERTIA):
                opinion.add(quantity, link.name, lump)
            continue
        other = partial(judged_other_mass, link, link.inertial, least_density(link.name, tied))
        mass = opinion.add(Quantity.MASS, link.name, found[link.name], link.inertial.mass_kg, other)
        rest = (ALONE, ALONE)
        if mass.trust is Trust.PLAUSIBLE:
            rest = judged_centre(link, link.inertial), judged_inertia(link, link.inertial, settings)
        if mass.trust is not Trust.IMPOSSIBLE:
            for quantity, belief in zip((Quantity.CENTRE, Quantity.INERTIA), rest, strict=True):
                opinion.add(quantity, link.name, belief)


def stated_masses(
    features: Features,
    tied: Collection[str],
    leaves: Collection[str],
    proposals: Mapping[str, LinkProposal],
    settings: PhysicsSettings,
) -> dict[str, Belief]:
    """Link with geometry → the belief in its stated mass by itself. ``tied`` ones follow another's joint."""
    unweighed, found = placeholders(features.links, tied), dict[str, Belief]()
    for link in features.links:
        if link.inertial is None or not link.has_geometry:
            continue
        belief = judged_mass(link, link.inertial, link.name not in unweighed, least_density(link.name, tied))
        if belief.trust is Trust.PLAUSIBLE and is_of_another_shape(link, link.inertial, settings):
            belief = doubtful_belief("its centre and inertia are another shape's")
        if belief.trust is Trust.PLAUSIBLE and link.name in leaves:
            belief = judged_leaf(link, link.inertial, proposals.get(link.name), settings)
        found[link.name] = belief
    return found


def judged_mass(link: LinkFeatures, stated: LinkInertial, weighed: bool, least: float) -> Belief:
    """Belief in a stated mass, by its density over its hull. ``least`` of that, kg/m³, is 0 for a part that follows
    another's joint, which its author made light for the hand that moves both. Not ``weighed`` is what has the same mass
    and inertia as unlike links, or its format's default."""
    if stated.mass_kg <= 0.0:
        return impossible_belief("no body is without mass")
    density = authored_density(link)
    if density is None:
        return doubtful_belief("its geometry has no volume that could weigh this")
    if not weighed:
        return doubtful_belief(
            "its mass and inertia are unlike links', too, or a format's default, as exporters write where nothing was "
            "weighed"
        )
    if not least <= density <= MOST_DENSITY_KG_M3:
        return doubtful_belief(f"not {PLAUSIBLE_MASS.reason}")
    if least > 0.0 and is_plate_of_nothing(link):
        return doubtful_belief(f"its plates would be of a material of less than {LEAST_MATERIAL_KG_M3:g} kg/m³")
    return PLAUSIBLE_MASS


def least_density(name: str, tied: Collection[str]) -> float:
    """Least density over its hull that is believed of a link, kg/m³: none of ``tied`` ones, which their authors made
    light."""
    return 0.0 if name in tied else LEAST_DENSITY_KG_M3


def judged_whole(
    large: Sequence[LinkFeatures],
    found: Mapping[str, Belief],
    proposals: Mapping[str, LinkProposal],
    settings: PhysicsSettings,
    least_share: float,
) -> dict[str, Belief]:
    """Link → the belief in its stated mass where that was believed by itself and is not, since those of the ``large``
    links, casings and leaves, are together less than ``least_share`` of what these weigh as proposed, and it is."""
    links = [link for link in large if link.name in found and found[link.name].trust is Trust.PLAUSIBLE]
    stated = {link.name: link.inertial.mass_kg for link in links if link.inertial is not None}
    built = {link.name: built_mass(link, proposals.get(link.name), settings) for link in links}
    if sum(stated.values()) >= least_share * sum(built.values()):
        return {}
    light = [name for name in stated if stated[name] < least_share * built[name]]
    reason = "such a part weighs {:.2g} kg, and all that are stated state too little together"
    return {name: doubtful_belief(reason.format(built[name])) for name in light}


def built_mass(link: LinkFeatures, proposal: LinkProposal | None, settings: PhysicsSettings) -> float:
    """The mass, kg, of a link built as proposed; 0 where nothing is."""
    if proposal is None or proposal.density_kg_m3 is None:
        return 0.0
    return built_link(link, proposal.model_copy(update={"mass_kg": None}), 1.0, settings, np.eye(3)).mass


def judged_leaf(
    link: LinkFeatures, stated: LinkInertial, proposal: LinkProposal | None, settings: PhysicsSettings
) -> Belief:
    """Belief in the stated mass of a door, drawer or lid, by what one built as proposed weighs."""
    built = built_mass(link, proposal, settings)
    if proposal is None or stated.mass_kg >= settings.least_leaf_share * built:
        return PLAUSIBLE_MASS
    return doubtful_belief(f"one of {proposal.material or 'its material'} weighs {built:.2g} kg")


def heaviest_neighbour(name: str, opinion: Opinion, features: Features) -> float:
    """Largest stated mass, kg, that is believed of a link joined to this one; 0 where none is."""
    pairs = [(joint.parent, joint.child) for joint in features.joints]
    near = {one for pair in pairs if name in pair for one in pair} - {name}
    stated = {link.name: link.inertial for link in features.links if link.name in near}
    believed = (own.mass_kg for link, own in stated.items() if own and Quantity.MASS in opinion.kept(link))
    return max(believed, default=0.0)


def judged_lump(stated: LinkInertial, beside_kg: float, features: Features) -> Belief:
    """Belief in mass, centre and inertia of a link without geometry, all or none of them: by those that it is joined
    to, ``beside_kg`` at most, and by the object's size."""
    if stated.mass_kg <= 0.0:
        return impossible_belief("no body is without mass")
    if stated.mass_kg > beside_kg:
        return doubtful_belief("it has no geometry that could weigh this")
    moments, reach = moments_of(stated), float(np.linalg.norm(features.rest_size))
    if moments is None:
        return doubtful_belief("it has no geometry, and an inertia that no body has")
    far = np.linalg.norm(stated.com) > reach or float(moments.sum()) > 2.0 * stated.mass_kg * reach**2
    return doubtful_belief("it has no geometry, and would reach beyond the object") if far else LUMP


def judged_other_mass(link: LinkFeatures, stated: LinkInertial, least: float, mass_kg: float) -> Belief:
    """Belief in another mass, kg, in place of the stated one."""
    other = stated.model_copy(update={"mass_kg": mass_kg})
    return judged_mass(link.model_copy(update={"inertial": other}), other, weighed=True, least=least)


def judged_centre(link: LinkFeatures, stated: LinkInertial) -> Belief:
    """Belief in a stated centre of mass, by the box of its link."""
    low, high = np.asarray(link.box_min), np.asarray(link.box_max)
    margin, com = BOX_MARGIN * (high - low), np.asarray(stated.com)
    inside = bool(np.all(com >= low - margin) and np.all(com <= high + margin))
    return (
        Belief(trust=Trust.PLAUSIBLE, reason="it lies in its part")
        if inside
        else doubtful_belief("it lies outside its part")
    )


def is_of_another_shape(link: LinkFeatures, stated: LinkInertial, settings: PhysicsSettings) -> bool:
    """Whether a stated inertial, of a centre that is not merely left at zero, was copied from another body: neither
    centre nor inertia are its link's."""
    own = judged_centre(link, stated), judged_inertia(link, stated, settings)
    return any(stated.com) and all(belief.trust is not Trust.PLAUSIBLE for belief in own)


def judged_inertia(link: LinkFeatures, stated: LinkInertial, settings: PhysicsSettings) -> Belief:
    """Belief in a stated inertia, by what a body can have, and by what the mass has in the link's shape."""
    moments = moments_of(stated)
    if moments is None:
        return impossible_belief("no body has such moments")
    ratio = float(moments.sum()) / (stated.mass_kg * float(np.trace(tensor_of(link.unit_inertia))))
    factor = settings.inertia_factor
    if not 1.0 / factor <= ratio <= factor:
        return doubtful_belief(f"more than {factor:g} times off what its mass has in its shape")
    return Belief(trust=Trust.PLAUSIBLE, reason=f"within {factor:g} times of what its mass has in its shape")


def moments_of(stated: LinkInertial) -> Array | None:
    """(3,) principal moments of inertia, kg·m², the least first; None of such as no body has."""
    moments = np.asarray(np.linalg.eigvalsh(tensor_of(stated.inertia)), dtype=np.float64)
    triangle = moments[2] <= (1.0 + TRIANGLE_SLACK) * (moments[0] + moments[1])
    return moments if moments[0] > 0.0 and triangle else None
