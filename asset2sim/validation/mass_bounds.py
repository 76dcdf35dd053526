"""Bound each link's inertia by the extent of its shape, and the mass of what is pressed by what stands behind it."""

from collections.abc import Container, Mapping, Sequence
from dataclasses import replace

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.validation.masses import LinkMass
from schemas.features import Features, LinkFeatures
from schemas.finding import Notes
from schemas.settings import PhysicsSettings
from schemas.vocabulary import MassRule, Source


def bound_inertia_by_extent(
    masses: Mapping[str, LinkMass],
    links: Sequence[LinkFeatures],
    points: Mapping[str, Array],
    settings: PhysicsSettings,
    notes: Notes,
) -> dict[str, LinkMass]:
    """The link masses, no inertia larger than that of the mass placed on the shape's outermost points.

    Otherwise a proposed or added inertia could make a thin key as hard to turn as an object many times its size. A
    sheet counts as ``min_half_extent_m`` thick to either side, as its collision shape. ``points`` are each link's
    (n, 3) hull points in its frame, m.
    """
    result = dict(masses)
    for link in links:
        cloud = points[link.name]
        if len(cloud) == 0:
            continue
        item = masses[link.name]
        least = settings.min_half_extent_m if link.hull_volume_m3 == 0.0 else settings.least_reach_m
        bounded = bounded_inertia(item.inertia, item.mass, cloud - item.com, least)
        if bounded is None:
            continue
        notes.info(
            "inertia_reach",
            f"link '{link.name}': inertia lowered to what {item.mass:.3g} kg on its outermost points would have",
            link=link.name,
            value=float(np.trace(item.inertia)),
            limit=float(np.trace(bounded)),
        )
        result[link.name] = replace(item, inertia=bounded, inertia_source=Source.RULE)
    return result


def bounded_inertia(inertia: Array, mass: float, points: Array, least: float) -> Array | None:
    """The (3, 3) inertia, kg·m², with second moments of mass at most ``mass`` · reach²; None where they already are.

    ``points`` (n, 3) are relative to the centre of mass, m, and ``least`` is the smallest reach, m. The second moments
    ∫ x xᵀ dm = tr(I)/2 · 1 − I have the same principal axes as the inertia; lowering them keeps it one that a body can
    have.
    """
    moments, axes = np.linalg.eigh(np.trace(inertia) / 2.0 * np.eye(3) - inertia)
    reach = np.maximum(np.abs(points @ axes).max(axis=0), least)
    lowered = np.minimum(np.maximum(moments, 0.0), mass * reach**2)
    if np.all(lowered >= moments - 1e-6 * np.abs(moments).max()):
        return None
    second: Array = axes @ np.diag(lowered) @ axes.T
    bounded: Array = np.trace(second) * np.eye(3) - second
    return bounded


def with_armature(
    masses: dict[str, LinkMass], features: Features, settings: PhysicsSettings, notes: Notes
) -> dict[str, LinkMass]:
    """The link masses with inertia added, equal about every axis, where a jointed neighbour has far more.

    A key's 10⁻⁸ kg·m² beside a board's 10⁻² is lost in a solver in single precision. Each moment becomes at least the
    largest moment of the neighbour divided by ``max_inertia_ratio``; masses are unchanged.
    """
    result = dict(masses)
    moments = {name: np.linalg.eigvalsh(item.inertia) for name, item in masses.items()}
    for joint in features.movable_joints:
        for thin, thick in ((joint.child, joint.parent), (joint.parent, joint.child)):
            least = float(moments[thick][-1]) / settings.max_inertia_ratio
            missing = least - float(moments[thin][0])
            if missing <= 0.0:
                continue
            message = (
                f"link '{thin}': {missing:.3g} kg·m² added about every axis: it moves on '{thick}', whose inertia is "
                "more than engines handle beside it"
            )
            notes.info("inertia_ratio", message, link=thin, value=missing, limit=least)
            tensor = result[thin].inertia + missing * np.eye(3)
            result[thin] = replace(result[thin], inertia=tensor, inertia_source=Source.RULE)
            moments[thin] = moments[thin] + missing
    return result


def with_plungers(
    masses: dict[str, LinkMass], features: Features, pressed: Container[str], settings: PhysicsSettings, notes: Notes
) -> dict[str, LinkMass]:
    """The link masses, that of a part on a ``pressed`` slider at least ``least_pressed_kg``: drawn is but its cap."""
    result, least = dict(masses), settings.least_pressed_kg
    for joint in features.movable_joints:
        item = result[joint.child]
        if joint.name not in pressed or not joint.prismatic or item.mass >= least or item.mass_source is Source.USER:
            continue
        message = f"link '{joint.child}': {item.mass:.2g} kg raised to {least:.2g} kg, with the plunger behind its cap"
        notes.info("mass_raised", message, link=joint.child, value=item.mass, limit=least)
        inertia = item.inertia * least / item.mass
        result[joint.child] = replace(
            item,
            mass=least,
            mass_source=Source.RULE,
            rule=MassRule.BOUNDED,
            inertia=inertia,
            inertia_source=Source.RULE,
        )
    return result
