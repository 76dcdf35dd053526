"""The stands check: the object, set down in the state asked of it, stays upright, where it is and without a jump."""

import math
from collections.abc import Mapping

from asset2sim.checks.declared_check import DeclaredCheck
from asset2sim.checks.rig import Rig
from schemas.interaction import Interaction, Stand
from schemas.overlay import JointPhysics
from schemas.thresholds import Thresholds
from schemas.verdict import CheckVerdict, Guide
from schemas.vocabulary import FailureMode


def measure(rig: Rig) -> dict[str, object]:
    """How the object stands where it is set down; of a fixed object, which cannot tip, nothing is said."""
    return {"stand": rig.down().stand}


def judge(seen: Interaction, joints: Mapping[str, JointPhysics], limits: Thresholds) -> list[CheckVerdict]:
    """One verdict, on the whole object."""
    return [] if seen.stand is None else [stand_verdict(seen.stand, seen.engine.value, limits)]


def stand_verdict(item: Stand, engine: str, limits: Thresholds) -> CheckVerdict:
    """An object must stay as it is set down: upright, where it is, without a jump, and by more than a touch."""
    placed = f"set down in its initial state in {engine} it"
    checks = (
        (item.tilt_rad, limits.stands_rad, f"{placed} tilts by {math.degrees(item.tilt_rad):.3g}°"),
        (item.travel_m, limits.stands_m, f"{placed} travels {100.0 * item.travel_m:.3g} cm"),
        (item.peak_speed_m_s, limits.stands_m_s, f"{placed} moves at {item.peak_speed_m_s:.3g} m/s"),
    )
    margin = f"its margin to tip over is {math.degrees(item.margin_rad):.3g}° ({item.tip_energy_j:.3g} J)"
    advice = "; lean it on something, fix it, or ask for a state in which it stands"
    for value, limit, text in checks:
        if value > limit or not item.finite:
            return CheckVerdict(FailureMode.STANDS, "object", False, value, limit, f"{text}; {margin}{advice}")
    if item.margin_rad < limits.stands_margin_rad and item.tip_energy_j < limits.touch_j:
        text = f"{placed} comes to rest on an edge: {margin}, so that a touch tips it over{advice}"
        return CheckVerdict(FailureMode.STANDS, "object", False, item.margin_rad, limits.stands_margin_rad, text)
    value, limit, text = checks[0]
    return CheckVerdict(FailureMode.STANDS, "object", True, value, limit, f"{text}; {margin}")


CHECK = DeclaredCheck(
    name="stands",
    modes={
        FailureMode.STANDS: Guide(
            "Set down as asked, it tips over, leans over 5°, slides over 3 cm, or stands on an edge",
            "ask for another state (a closed lid), or say in the guidance or by `--support` that it is fixed or "
            "handheld",
        )
    },
    done="set down in its initial state, from the first moment on",
    holds="it tilts at most 5°, travels at most 3 cm, moves at most at 0.5 m/s, and rests by 2° or more than a touch",
    bounds=("stands_rad", "stands_m", "stands_m_s", "stands_margin_rad", "touch_j"),
    measure=measure,
    judge=judge,
    place=10,
    turn=10,
    on_plane=True,
    along=(FailureMode.STATE,),
    planted=("centre of mass beyond its feet",),
)
