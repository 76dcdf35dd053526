"""SDF's gearboxes as joints that follow one another."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from asset2sim.intake.formats.mjcf_ties import Tie
from asset2sim.physics.arrays import Array


@dataclass(frozen=True)
class Hinge:
    """A hinge between two links, and its (3,) axis in the model's frame."""

    name: str
    parent: str
    child: str
    axis: Array


@dataclass(frozen=True)
class Gearbox:
    """A gearbox: the turn of ``second`` in the reference ``body``, about the second of its (3,) axes in the model's
    frame, is ``-ratio`` times that of ``first`` about the first."""

    name: str
    first: str
    second: str
    body: str
    ratio: float
    axes: tuple[Array, Array]


def gear_ties(gearboxes: Sequence[Gearbox], hinges: Sequence[Hinge]) -> Iterator[Tie | str]:
    """The tie of two hinges that each gearbox is; a note on one whose reference body has no such hinges."""
    for gear in gearboxes:
        first = turn_of(gear.first, gear.body, gear.axes[0], hinges)
        second = turn_of(gear.second, gear.body, gear.axes[1], hinges)
        if first is None or second is None or gear.ratio == 0.0:
            yield f"gearbox '{gear.name}' is left out: it ties no two hinges of its reference body '{gear.body}'"
        else:
            yield Tie(second[0], first[0], -gear.ratio * first[1] / second[1], 0.0)


def turn_of(link: str, body: str, axis: Array, hinges: Sequence[Hinge]) -> tuple[str, float] | None:
    """The hinge between a link and a body, and the sign that its position has in the link's turn about the axis."""
    for hinge in hinges:
        if {hinge.parent, hinge.child} == {link, body}:
            sign = math.copysign(1.0, float(axis @ hinge.axis))
            return hinge.name, sign if hinge.child == link else -sign
    return None
