"""Penetration: Φ = Σ over contact points of max(0, −separation) (paper, evaluation, section 1)."""

from collections.abc import Iterable
from dataclasses import dataclass

from schemas.base import Vector3
from schemas.interaction import ContactPair


@dataclass(frozen=True)
class ContactPoint:
    """One contact point: the two links, and their separation there, m (negative where they overlap)."""

    link_a: str
    link_b: str
    separation_m: float


@dataclass(frozen=True)
class LocatedContact(ContactPoint):
    """A contact point with its place in the root link's frame, m, and the unit normal there, from ``link_b`` to
    ``link_a``: along it ``link_a`` leaves ``link_b``."""

    place: Vector3
    normal: Vector3


def penetration(points: Iterable[ContactPoint]) -> float:
    """Φ of a set of contact points, m."""
    return sum(max(0.0, -point.separation_m) for point in points)


def by_pair(points: Iterable[ContactPoint]) -> tuple[ContactPair, ...]:
    """The overlapping link pairs, worst first, each with its deepest point and its share of Φ."""
    grouped: dict[tuple[str, str], list[float]] = {}
    for point in points:
        if point.separation_m < 0.0:
            first, second = sorted((point.link_a, point.link_b))
            grouped.setdefault((first, second), []).append(-point.separation_m)
    pairs = [
        ContactPair(link_a=a, link_b=b, depth_m=max(depths), penetration_m=sum(depths), n_points=len(depths))
        for (a, b), depths in grouped.items()
    ]
    return tuple(sorted(pairs, key=lambda pair: (-pair.penetration_m, pair.link_a, pair.link_b)))
