"""Correct a proposed state that contradicts the user's words: wrong end of a range, wrong part, or part left out.

Corrected only where the words say open or closed, and how far, of parts that the object has, and where geometry shows
clearly which end of a joint's range is closed. A proposal that merely differs from the words is kept.
"""

from dataclasses import dataclass

from asset2sim.guidance.lexicon import segments
from asset2sim.guidance.object_info import JointInfo, ObjectInfo
from asset2sim.guidance.parts import parts_of
from asset2sim.guidance.sizing import identify
from asset2sim.guidance.states import asked_states, useful_travel
from asset2sim.validation.notes import Notes
from schemas.overlay import Overlay
from schemas.settings import PhysicsSettings

NEAR_END = 0.4
"""Share of the range from an end within which a state counts as near that end; in the middle no end is wrong."""
BEYOND = 0.05
"""How far beyond an end, as a share of the range, a position is still accepted: prompts and models round."""

UPRIGHT = 0.9
"""Vertical component of a slider's unit axis from which one end of its range counts as the upper one."""

WHOLE = "state: object "
"""Start of the parser's note for words that ask for a state of the whole object and name no known part."""


@dataclass(frozen=True)
class RequestedState:
    """The state that the words ask of a joint: ``share`` from closed (0) to open (1), and the position, rad or m at the
    authored scale. ``by_name``: the words name the part, not only the whole object ("an open box"). ``words`` says the
    state ("slightly open"), ``travel`` how far the part is opened in use."""

    joint: JointInfo
    share: float
    position: float
    by_name: bool
    words: str
    travel: float


def with_asked_state(
    info: ObjectInfo, guidance: str, overlay: Overlay, settings: PhysicsSettings, notes: Notes
) -> Overlay:
    """The overlay with initial positions that agree with what the words clearly say; a finding for each change."""
    named, wanted = read_states(info, guidance, overlay.scale, settings)
    positions, asked = dict(overlay.initial_joint_positions), list(overlay.asked)
    joints = {joint.name: joint for joint in info.joints}
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


def note_out_of_reach(info: ObjectInfo, guidance: str, scale: float, notes: Notes) -> None:
    """A warning for each state whose number its joint cannot take: degrees of a slide, more than its whole range."""
    size, _ = identify(info, guidance)
    asked = asked_states(info, parts_of(info, size.category), segments(guidance, size.category), scale)
    joints = {joint.name: joint for joint in info.joints}
    for name, state in asked.states.items():
        joint, measure = joints[name], state.measure
        if measure is None or joint.range == 0.0 or joint.motion == "spin":
            continue
        slides = joint.motion == "slider"
        unit, reach = ("m", joint.range * scale) if slides else ("rad", joint.range)
        said = f"{measure.number:.4g} {'m' if measure.kind == 'length' else 'rad'}"
        if slides != (measure.kind == "length"):
            why = f"it {'slides' if slides else 'turns'} and is measured in {unit}"
        elif measure.number > reach * (1.0 + BEYOND):
            why = f"it opens by {reach:.4g} {unit} at most"
        else:
            continue
        message = f"joint '{name}': the words ask to open it by {said}, which cannot be met: {why}"
        notes.warn("state_out_of_reach", message, joint=name, value=measure.number, limit=reach)


def read_states(
    info: ObjectInfo, guidance: str, scale: float, settings: PhysicsSettings
) -> tuple[frozenset[str], dict[str, RequestedState]]:
    """The joints that the words name, and the requested state of those where words and geometry are clear.

    None is clear where the words ask for a state of a part that the object seems not to have: they may then call a part
    by a name that is not known here.
    """
    size, _ = identify(info, guidance)
    parts = parts_of(info, size.category)
    asked = asked_states(info, parts, segments(guidance, size.category), scale)
    joints, used = (
        {joint.name: joint for joint in info.joints},
        {part.joint.name: useful_travel(part) for part in parts},
    )
    wanted: dict[str, RequestedState] = {}
    if any("has no" in note for note in asked.notes):
        return frozenset(asked.positions), wanted
    for name, position in asked.positions.items():
        joint, kind = joints[name], asked.states[name].kind
        sure = joint.open_confidence >= settings.sure_of_closed
        # Which end of an upright slide is up needs no confidence.
        upright = joint.motion == "slider" and abs(joint.axis[2]) > UPRIGHT
        clear = (kind == "open" and sure) or (kind in ("up", "down") and upright)
        if clear and joint.range > 0.0 and joint.motion != "spin":
            whole = any(note.startswith(WHOLE) and note.endswith(f" {name}") for note in asked.notes)
            words = asked.states[name].describe()
            share = share_of(joint, position)
            wanted[name] = RequestedState(joint, share, position, not whole, words, used[name])
    return frozenset(asked.positions), wanted


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
