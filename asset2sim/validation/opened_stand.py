"""How an object stands with a part open that is not asked to be: whether its lid or door pulls it over."""

import math
from collections.abc import Mapping

from asset2sim.physics.mass_matrix import GRAVITY_M_S2, PosedObject
from asset2sim.physics.on_floor import UP
from asset2sim.physics.support_polygon import leaning_on
from asset2sim.validation.handling import Handling
from asset2sim.validation.positions import Start
from schemas.finding import Notes
from schemas.thresholds import Thresholds

SHARES = (0.25, 0.5, 0.75, 1.0)
"""Shares of its way at which a part is looked at."""


def note_tips_when_open(
    item: PosedObject, starts: Mapping[str, Start], handled: Mapping[str, Handling], limits: Thresholds, notes: Notes
) -> None:
    """A finding for each door and lid of a free object, at the final scale, that stands as asked and tips over, or
    would by a touch, with it open further."""

    def tips(positions: Mapping[str, float]) -> bool:
        posed = item.at(positions)
        support = leaning_on(posed.cloud, posed.center, posed.mass, UP)
        weak = support.margin_rad < limits.stands_margin_rad
        return weak and support.mass * GRAVITY_M_S2 * support.rise < limits.touch_j

    here = {name: start.position for name, start in starts.items()}
    leaves = [name for name in starts if name in handled and handled[name].leaf]
    if not leaves or tips(here):
        return
    for name in leaves:
        span = starts[name].range
        if span.joint.mimic is not None or span.joint.prismatic:
            continue
        ways = (span.closed + share * (span.open - span.closed) for share in SHARES)
        bad = next((way for way in ways if tips(here | {name: way})), None)
        if bad is None:
            continue
        open_deg = math.degrees(abs(bad - span.closed))
        message = (
            f"joint '{name}': open by {open_deg:.0f}° its part pulls the object over, which "
            "stands as asked: hold it meanwhile, fix it, or ask for less"
        )
        notes.info("tips_when_open", message, joint=name, value=bad, limit=span.open)
