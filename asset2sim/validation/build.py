"""How a link is built: shell or solid, with what is inside, and the mass, centre and inertia that follow from it."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from asset2sim.guidance.parts import part_name
from asset2sim.guidance.tables import materials, part_material, sizes
from asset2sim.physics.arrays import Array
from asset2sim.physics.inertia import box_inertia, solid_to_shell, tensor_of, wall_volume
from schemas.base import Vector3
from schemas.features import Features, LinkFeatures
from schemas.finding import Notes
from schemas.overlay import Content, LinkProposal
from schemas.settings import PhysicsSettings
from schemas.vocabulary import MassRule, VolumeSource

PLATES = frozenset(("door", "lid", "shelf", "screen", "tray"))
"""Parts that are plates, which drawings often have as sheets."""
DRAWN_SHARE = 0.5
"""Share of its kind's thickness from which a part is drawn as it is, and no sheet."""
WALL_EXPONENT = 0.5
"""Thickness over length of an object smaller than the usual: half way between the same wall and one to scale."""


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
    link: LinkFeatures,
    proposal: LinkProposal | None,
    scale: float,
    settings: PhysicsSettings,
    to_root: Array,
    upright_m: Vector3 | None = None,
    foot: tuple[float, float] | None = None,
) -> Built:
    """The link as proposed, or of a fallback material. ``to_root`` is the (3, 3) rotation into the root's frame, and
    ``upright_m`` the edges of its box along that frame's axes, by which contents are placed; None: those of its own.
    ``foot`` is the middle of its foot in that box, as shares, where it is not the box's."""
    volume, hull, outer = link.volume_m3 * scale**3, link.hull_volume_m3 * scale**3, link.outer_m2 * scale**2
    density, hollow, wall = settings.fallback_density_kg_m3, settings.fallback_hollow_factor, 0.0
    material, contents = None, tuple[Content, ...]()
    if proposal is not None:
        material, contents = proposal.material, tuple(over_foot(item, foot) for item in proposal.contents)
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
        com = solid_to_shell(com, np.asarray(link.shell_center) * scale, filled)
        inertia = solid_to_shell(solid, sheet, filled)
    mass = material_m3 * density
    upright = np.abs(to_root) @ np.asarray(link.box_size) if upright_m is None else np.asarray(upright_m)
    mass, com, inertia = with_contents(mass, com, inertia, contents, link, scale, to_root, upright * scale)
    rule = MassRule.SHELL if shell else MassRule.SOLID
    made_of = (material, density, hollow, volume, link.volume_source, outer, wall if shell else 0.0, contents, rule)
    return Built(*made_of, mass, com, inertia)


def as_thick_as_their_kind(
    features: Features, proposals: Mapping[str, LinkProposal], scale: float, theirs: Collection[str], notes: Notes
) -> dict[str, LinkProposal]:
    """The proposals, those of parts drawn as sheets, that are a share of what is drawn, with a wall as heavy as their
    kind's (``parts.csv``), or as thick as such a wall is of a material that the tables know: thinner of objects smaller
    than the usual. Not of the links of
    ``theirs``, whose masses are the user's, nor where a part is drawn ``DRAWN_SHARE`` as thick."""
    size = sizes().get(features.category)
    small = min(scale * max(features.closed_size) / size.typical_m, 1.0) if size is not None else 1.0
    joints = {joint.child: joint.name for joint in features.movable_joints}
    found = dict(proposals)
    for link in features.links:
        answer = proposals.get(link.name)
        part = part_name(link.label, link.name, joints.get(link.name, ""))
        if answer is None or link.name not in joints or link.name in theirs or part not in PLATES:
            continue
        if answer.density_kg_m3 is None or answer.wall_m or answer.mass_kg is not None or link.outer_m2 <= 0.0:
            continue
        kind, drawn = part_material(features.category, part), link.volume_m3 * scale / link.outer_m2
        thick = kind.wall_m * small**WALL_EXPONENT
        usual, named = materials()[kind.material], materials().get((answer.material or "").strip().lower())
        wall = thick * usual.density_kg_m3 / answer.density_kg_m3
        if named is not None:
            wall = thick * named.wall_factor / usual.wall_factor
        if drawn >= DRAWN_SHARE * min(thick, wall):
            continue
        drawn *= 1.0 if answer.hollow_factor is None else answer.hollow_factor
        message = (
            f"link '{link.name}': drawn as a sheet it is {drawn * answer.density_kg_m3 * 2.0:.3g} kg/m²; a {part} has "
            f"{wall * answer.density_kg_m3 * 2.0:.3g} kg/m²: made of walls of {1e3 * wall:.2g} mm"
        )
        notes.info("sheet_thickened", message, link=link.name, value=drawn, limit=wall)
        found[link.name] = answer.model_copy(update={"hollow_factor": None, "wall_m": wall})
    return found


FOOT_HEIGHT = 0.05
"""Height in a link's box, as a share, up to which what is in its middle is in its foot: a lamp's weight."""


def over_foot(item: Content, foot: tuple[float, float] | None) -> Content:
    """The content, moved over the middle of the link's ``foot`` if it is in the foot."""
    if foot is None or item.at[:2] != (0.5, 0.5) or item.at[2] > FOOT_HEIGHT:
        return item
    return item.model_copy(update={"at": (*foot, item.at[2])})


def with_contents(
    mass: float,
    com: Array,
    unit_inertia: Array,
    contents: tuple[Content, ...],
    link: LinkFeatures,
    scale: float,
    to_root: Array,
    size: Array,
) -> tuple[float, Array, Array]:
    """Mass (kg), centre (m) and inertia per kg (m²) of a link with its contents, each a box in its place in one of
    (3,) ``size`` along the root's axes."""
    if not contents:
        return mass, com, unit_inertia
    middle = to_root @ (np.asarray(link.box_min) + np.asarray(link.box_max)) * scale / 2.0
    parts = [(mass, com, mass * unit_inertia)]
    for item in contents:
        place = (middle + (np.asarray(item.at) - 0.5) * size) @ to_root
        parts.append((item.mass_kg, place, to_root.T @ box_inertia(item.mass_kg, size * item.extent) @ to_root))
    total = math.fsum(part[0] for part in parts)
    middle = np.sum([part[0] * part[1] for part in parts], axis=0) / total
    inertia = np.zeros((3, 3))
    for kilograms, place, own in parts:
        offset = place - middle
        inertia += own + kilograms * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return total, middle, inertia / total
