"""How a link is built: shell or solid, with what is inside, and the mass, centre and inertia that follow from it."""

import math
from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.physics.inertia import box_inertia, tensor_of
from asset2sim.physics.wall_material import between, wall_volume
from schemas.features import LinkFeatures
from schemas.overlay import Content, LinkProposal
from schemas.settings import PhysicsSettings
from schemas.vocabulary import MassRule, VolumeSource


@dataclass(frozen=True)
class Built:
    """One link by construction, at the final scale: what it is made of, its mass (kg), its (3,) centre of mass and its
    (3, 3) inertia about that per kg (m²), both in the link's frame. ``wall`` (m) is 0 for a solid."""

    material: str | None
    density: float
    hollow: float
    volume: float
    volume_source: VolumeSource
    outer: float
    wall: float
    contents: tuple[Content, ...]
    rule: MassRule
    mass: float
    com: Array
    unit_inertia: Array


NOTHING_BUILT = Built(
    None, 0.0, 0.0, 0.0, VolumeSource.NONE, 0.0, 0.0, (), MassRule.SHARED, 0.0, np.zeros(3), np.zeros((3, 3))
)
"""A link without geometry."""


def built_link(
    link: LinkFeatures, proposal: LinkProposal | None, scale: float, settings: PhysicsSettings, to_root: Array
) -> Built:
    """The link as proposed, or of a fallback material. ``to_root`` is the (3, 3) rotation into the root's frame."""
    volume, hull, outer = link.volume_m3 * scale**3, link.hull_volume_m3 * scale**3, link.outer_m2 * scale**2
    density, hollow, wall = settings.fallback_density_kg_m3, settings.fallback_hollow_factor, 0.0
    material, contents = None, tuple[Content, ...]()
    if proposal is not None:
        material, contents = proposal.material, proposal.contents
        density = proposal.density_kg_m3 or density
        hollow = proposal.hollow_factor if proposal.hollow_factor is not None else hollow
        wall = proposal.wall_m or 0.0
    shell = wall > 0.0 and outer > 0.0
    material_m3 = wall_volume(outer, wall, hull, link.diagonal_m * scale) if shell else volume * hollow
    if shell:
        filled = material_m3 / hull if hull > 0.0 else 0.0
    else:
        # Of a mass that is stated as such nothing says that it is hollow.
        stated = proposal is not None and proposal.mass_kg is not None and proposal.hollow_factor is None
        filled = 1.0 if stated else hollow
    solid, sheet = tensor_of(link.unit_inertia) * scale**2, tensor_of(link.shell_inertia) * scale**2
    com, inertia = np.asarray(link.center) * scale, solid
    if outer > 0.0:
        com = between(com, np.asarray(link.shell_center) * scale, filled)
        inertia = between(solid, sheet, filled)
    mass = material_m3 * density
    mass, com, inertia = with_contents(mass, com, inertia, contents, link, scale, to_root)
    rule = MassRule.SHELL if shell else MassRule.SOLID
    made_of = (material, density, hollow, volume, link.volume_source, outer, wall if shell else 0.0, contents, rule)
    return Built(*made_of, mass, com, inertia)


def with_contents(
    mass: float,
    com: Array,
    unit_inertia: Array,
    contents: tuple[Content, ...],
    link: LinkFeatures,
    scale: float,
    to_root: Array,
) -> tuple[float, Array, Array]:
    """Mass (kg), centre (m) and inertia per kg (m²) of a link with its contents, each a box in its place."""
    if not contents:
        return mass, com, unit_inertia
    low, high = np.asarray(link.box_min) * scale, np.asarray(link.box_max) * scale
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T @ to_root.T
    root_low, root_size = corners.min(axis=0), np.ptp(corners, axis=0)
    parts = [(mass, com, mass * unit_inertia)]
    for item in contents:
        place = (root_low + np.asarray(item.at) * root_size) @ to_root
        parts.append((item.mass_kg, place, box_inertia(item.mass_kg, (high - low) * item.extent)))
    total = math.fsum(part[0] for part in parts)
    middle = np.sum([part[0] * part[1] for part in parts], axis=0) / total
    inertia = np.zeros((3, 3))
    for kilograms, place, own in parts:
        offset = place - middle
        inertia += own + kilograms * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return total, middle, inertia / total
