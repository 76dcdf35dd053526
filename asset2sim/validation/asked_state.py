"""Correct a proposed state that contradicts the user's words: wrong end of a range, wrong part, or part left out.

Corrected only where the words say open or closed, and how far, of parts that the object has, and where geometry shows
clearly which end of a joint's range is closed. A proposal that merely differs from the words is kept.
"""

from dataclasses import dataclass

from asset2sim.guidance.object_info import JointInfo, ObjectInfo
from asset2sim.guidance.parts import MovablePart, parts_of
from asset2sim.guidance.placing import asked_position, useful_travel
from schemas.finding import Notes
from schemas.guidance import AskedState, Guidance
from schemas.overlay import Overlay
from schemas.settings import PhysicsSettings

NEAR_END = 0.4
"""Share of the range from an end within which a state counts as near that end; in the middle no end is wrong."""
BEYOND = 0.05
"""How far beyond an end, as a share of the range, a position is still accepted: prompts and models round."""

UPRIGHT = 0.9
"""Vertical component of a slider's unit axis from which one end of its range counts as the upper one."""


@dataclass(frozen=True)
class RequestedState:
    """The state that the words ask of a joint: ``share`` from closed (0) to open (1), and the position, rad or m at the
    authored scale. ``by_name``: the words name the part, not only the whole object ("an open box"). ``words`` says the
    state ("slightly open"), ``travel`` how far the part is opened in use, ``or_more`` that it may be further open."""

    joint: JointInfo
    share: float
    position: float
    by_name: bool
    words: str
    travel: float
    or_more: bool = False

    def met_by(self, share: float) -> bool:
        """Whether a part that may be further open is so, up to its open end."""
        return self.or_more and self.share <= share <= 1.0 + BEYOND


def with_asked_state(
    info: ObjectInfo, guidance: Guidance, overlay: Overlay, settings: PhysicsSettings, notes: Notes
) -> Overlay:
    """The overlay with initial positions that agree with what the words clearly say; a finding for each change."""
    wanted = requested_states(info, guidance, overlay.scale, settings)
    positions, asked = dict(overlay.initial_joint_positions), list(overlay.asked)
    joints, named = {joint.name: joint for joint in info.joints}, guidance.of_joints
    stray = [name for name in positions if name in asked and name in joints and name not in named]
    for name, want in wanted.items():
        if name not in positions and not want.by_name:
            continue
        if name not in positions:
            source = stray.pop(0) if stray else None
            positions[name] = missing_position(
                want, None if source is None else (joints[source], positions[source]), notes
            )
            asked.append(name)
            if source is not None:
                del positions[source]
                asked.remove(source)
        positions[name] = mirrored_if_wrong_end(want, positions[name], notes)
    if positions == overlay.initial_joint_positions:
        return overlay
    return overlay.model_copy(update={"initial_joint_positions": positions, "asked": tuple(asked)})


def note_out_of_reach(info: ObjectInfo, guidance: Guidance, scale: float, notes: Notes) -> None:
    """A warning for each state whose number its joint cannot take: degrees of a slide, more than its whole range."""
    joints = {joint.name: joint for joint in info.joints}
    for name, wish in guidance.of_joints.items():
        joint, measure = joints[name], wish.state.measure
        if measure is None or joint.range == 0.0 or joint.motion == "spin":
            continue
        slides = joint.motion == "slider"
        unit, reach = ("m", joint.range * scale) if slides else ("rad", joint.range)
        asked = f"{measure.amount:.4g} {'m' if measure.kind == 'length' else 'rad'}"
        if slides != (measure.kind == "length"):
            why = f"it {'slides' if slides else 'turns'} and is measured in {unit}"
        elif measure.amount > reach * (1.0 + BEYOND):
            why = f"it opens by {reach:.4g} {unit} at most"
        else:
            continue
        message = f"joint '{name}': the words ask to open it by {asked}, which cannot be met: {why}"
        notes.warn("state_out_of_reach", message, joint=name, value=measure.amount, limit=reach)


def requested_states(
    info: ObjectInfo, guidance: Guidance, scale: float, settings: PhysicsSettings
) -> dict[str, RequestedState]:
    """Joint → the state that the words ask of it, where words and geometry are clear.

    None is clear where the words ask for a state of a part that the object seems not to have: they may then call a part
    by a name that is not known here.
    """
    if guidance.lacking:
        return {}
    parts = {part.joint.name: part for part in parts_of(info, guidance.category)}
    clear = {name: wish for name, wish in guidance.of_joints.items() if is_clear(parts[name].joint, wish, settings)}
    unnamed = {wish.joint for wish in guidance.states if not wish.by_name}
    return {name: requested_state(parts[name], wish, scale, name not in unnamed) for name, wish in clear.items()}


def is_clear(joint: JointInfo, wish: AskedState, settings: PhysicsSettings) -> bool:
    """Whether geometry shows clearly where in its range a joint is in the state that is asked of it."""
    if joint.range <= 0.0 or joint.motion == "spin":
        return False
    if wish.state.kind in ("up", "down"):  # Which end of an upright slide is up needs no confidence.
        return joint.motion == "slider" and abs(joint.axis[2]) > UPRIGHT
    return wish.state.kind == "open" and joint.open_confidence >= settings.sure_of_closed


def requested_state(part: MovablePart, wish: AskedState, scale: float, by_name: bool) -> RequestedState:
    """The state that a wish asks of a part's joint; ``scale`` is the final one."""
    position = asked_position(part, wish, scale)
    share = share_of(part.joint, position)
    state, travel = wish.state, useful_travel(part)
    return RequestedState(part.joint, share, position, by_name, state.describe(), travel, state.in_use and share > 0.0)


def missing_position(want: RequestedState, stray: tuple[JointInfo, float] | None, notes: Notes) -> float:
    """Position of a joint that the words name but the proposal omits, or gives to another joint (``stray``)."""
    name = want.joint.name
    if stray is None:
        message = (
            f"joint '{name}': the user's words ask a state of it, and the proposal has none; set to "
            f"{want.position:.4g}, {want.share:.0%} open"
        )
        notes.warn("state_missing", message, joint=name, value=None, limit=want.position)
        return want.position
    other, at = stray
    share = min(max(share_of(other, at), 0.0), 1.0) if other.range > 0.0 and other.motion != "spin" else want.share
    position = want.joint.closed + share * (want.joint.open - want.joint.closed)
    message = (
        f"joint '{name}': the proposal gives the state that the user's words ask of it to joint '{other.name}', which "
        f"they do not name; moved, {share:.0%} open"
    )
    notes.warn("state_of_wrong_part", message, joint=name, value=at, limit=position)
    return position


def mirrored_if_wrong_end(want: RequestedState, at: float, notes: Notes) -> float:
    """The position, mirrored in the range where it lies near the end opposite to what the words say."""
    share = share_of(want.joint, at)
    if want.or_more:
        wrong = -BEYOND <= share <= min(NEAR_END, 0.5 * want.share)
    else:
        wrong = (want.share <= NEAR_END and 1.0 - NEAR_END <= share <= 1.0 + BEYOND) or (
            want.share >= 1.0 - NEAR_END and -BEYOND <= share <= NEAR_END
        )
    if not wrong:
        return at
    mirrored = want.joint.closed + want.joint.open - at
    message = (
        f"joint '{want.joint.name}': {at:.4g} is {share:.0%} open, where the user's words ask for {want.share:.0%}; "
        f"counted from the other end it is {mirrored:.4g}, {1.0 - share:.0%} open"
    )
    notes.warn("state_at_wrong_end", message, joint=want.joint.name, value=at, limit=mirrored)
    return mirrored


def share_of(joint: JointInfo, at: float) -> float:
    """How far a position is on the way from closed (0) to open (1)."""
    return (at - joint.closed) / (joint.open - joint.closed)
