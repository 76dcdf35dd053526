"""A joint's damping, friction and stiffness as a hand feels them: how soon it stops, what opens it, what it holds."""

import math
from collections.abc import Sequence

from asset2sim.catalog.read import FrameRow
from asset2sim.catalog.text import significant
from asset2sim.physics.timing import glide_distance
from schemas.settings import PhysicsSettings

ENDLESS_S = 600.0
"""Time to stop beyond which a joint is said not to, s."""

NO_MOTION = 1e-6
"""Position, m or rad, that is 0 to anybody."""
AT_ONCE_S = 0.02
"""Time too short to be seen, s."""
LONG_M = 10.0
"""Way that is told in metres, m."""
MANY_TURNS = 10.0
"""Turns from which on angles are told in them."""
AT_END = 0.01
"""Distance from the end of a joint's way at which it rests there, rad or m."""
UNFELT_N = 0.01
"""Force that no hand feels, N: the weight of a gram."""


def stopping_time_s(speed: float, inertia: float, damping: float, friction: float) -> float:
    """Time (s) in which damping and dry friction stop ``inertia`` from ``speed`` on a level path, to a twentieth where
    only damping brakes it; inf where nothing does."""
    if speed <= 0.0 or inertia <= 0.0:
        return 0.0
    decay = inertia / damping if damping > 0.0 else math.inf
    if friction <= 0.0:
        return 3.0 * decay
    deceleration = friction / inertia
    # Without damping to speak of the logarithm's first term is all there is.
    if decay > 1e6 * speed / deceleration:
        return speed / deceleration
    return decay * math.log1p(speed / (deceleration * decay))


def sensations(joint: FrameRow, checks: Sequence[FrameRow]) -> list[tuple[str, str]]:
    """Sensations at a joint, as (what, words): its coasting, its opening force, its hold, its return.
    ``checks`` are the joint's rows of the table ``interactions``."""
    opened = _opening(joint, checks)
    held, returned = _hold(joint), _return(checks)
    return [("let go moving", _coasting(joint)), *opened, *held, *returned]


def _coasting(joint: FrameRow) -> str:
    slides, settings = joint["position_unit"] == "m", PhysicsSettings()
    speed = settings.usual_speed_m_s if slides else settings.usual_speed_rad_s
    inertia, damping, friction = (float(joint[name]) for name in ("effective_inertia", "damping", "friction"))
    inertia += float(joint.get("armature") or 0.0)
    seconds = stopping_time_s(speed, inertia, damping, friction)
    given = f"from {significant(speed)} m/s" if slides else f"from {significant(math.degrees(speed), digits=2)}°/s"
    way = glide_distance(speed, inertia / damping, friction / inertia) if damping > 0.0 and inertia > 0.0 else None
    lower, upper = joint.get("lower"), joint.get("upper")
    if way is not None and lower is not None and upper is not None and way >= upper - lower:
        return f"{given} on the level it runs through its whole range, {position_in_words(upper - lower, slides)}"
    if seconds > ENDLESS_S:
        return f"{given} it coasts on: nothing brakes it"
    far = "" if way is None else f", after {position_in_words(way, slides)}"
    when = "at once" if seconds < AT_ONCE_S else f"in {significant(seconds, 's', 2)}"
    return f"{given} on the level it stops {when}{far}"


def _opening(joint: FrameRow, checks: Sequence[FrameRow]) -> list[tuple[str, str]]:
    found = []
    for way in ("opening", "closing"):
        rows = [row for row in checks if row["test"] == "effort" and row["way"] == way]
        if rows:
            low, high = (least(row["value"] for row in rows) for least in (min, max))
            # Engines agree within a few per cent: one number where they do.
            value = (
                significant(high, "N", 2)
                if high - low <= 0.1 * high
                else f"{significant(low, digits=2)} to {significant(high, 'N', 2)}"
            )
            value = f"less than {significant(UNFELT_N, 'N')}, which no hand feels," if high < UNFELT_N else value
            found.append((f"{way} takes", f"{value} at its edge{_usual(joint) if way == 'opening' else ''}"))
    return found


def _usual(joint: FrameRow) -> str:
    kind, least, most = (joint.get(name) for name in ("effort_kind", "effort_least_n", "effort_most_n"))
    if kind is None or most is None:
        return ""
    span = (
        f"up to {significant(most, 'N', 3)}"
        if not least
        else f"{significant(least, digits=3)} to {significant(most, 'N', 3)}"
    )
    return f"; a {kind} takes {span}"


MECHANISMS = {
    "detent": "clicks from place to place and is kept there by up to",
    "bistable": "snaps to the end that is nearer and is pressed there by",
    "seal": "a gasket keeps it shut by up to",
    "latch": "a catch keeps it shut by up to",
    "strut": "a strut lifts it by up to",
    "spring return": "pressed shut, it presses back by up to",
}
"""Mechanism → its effort on a joint besides a spring, in words."""


def _hold(joint: FrameRow) -> list[tuple[str, str]]:
    unit = "N" if joint["position_unit"] == "m" else "N·m"
    load, friction, spring = abs(float(joint["gravity_load"])), float(joint["friction"]), float(joint["stiffness"])
    if joint.get("mechanism_effort"):
        kind = str(joint["mechanism"])
        said = f"{MECHANISMS.get(kind, f'{kind}, up to')} {significant(float(joint['mechanism_effort']), unit)}"
        return [("mechanism", f"{said}; its friction is {significant(friction, unit)}")]
    if joint["holds"]:
        if load < 1e-9 * max(friction, 1e-9) or load == 0.0:
            return [
                ("holds", f"stays where it is put: gravity does not pull it, friction is {significant(friction, unit)}")
            ]
        ends = [end for end in (joint.get("lower"), joint.get("upper")) if end is not None]
        start = joint.get("initial_position")
        if load > friction and start is not None and any(abs(start - end) < AT_END for end in ends):
            return [("holds", f"rests at the end of its way, where gravity presses it by {significant(load, unit)}")]
        return [
            ("holds", f"stays where it is put: friction {significant(friction, unit)} bears gravity's "
             f"{significant(load, unit)}, {significant(friction / load, digits=2)} times over")
        ]  # fmt: skip
    if spring > 0.0:
        return [("does not hold", "its spring brings it back")]
    if load > friction:
        return [
            (
                "does not hold",
                f"gravity moves it: {significant(load, unit)} against friction {significant(friction, unit)}",
            )
        ]
    return [("moves freely", f"friction {significant(friction, unit)} is all that stops it")]


def _return(checks: Sequence[FrameRow]) -> list[tuple[str, str]]:
    rows = [row for row in checks if row["test"] == "release"]
    return [("let go away from rest", str(rows[0]["reason"]))] if rows else []


def position_in_words(value: float | None, slides: bool) -> str:
    """A joint position for people: mm for a slider, m for a long one, degrees for a hinge, turns for many."""
    if value is None:
        return "–"
    value = 0.0 if abs(value) < NO_MOTION else value
    if slides:
        return significant(value, "m", 3) if abs(value) >= LONG_M else significant(1e3 * value, "mm", 3)
    if abs(value) > MANY_TURNS * math.tau:
        return f"{significant(value / math.tau)} turns"
    return f"{significant(math.degrees(value), digits=3)}°"
