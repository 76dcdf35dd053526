"""The requested state against the user's words: the wrong end of a range, the wrong part, and what was left out.

Corrected only where both are clear: words that say open or closed, and how far, of parts that the object has; and
geometry that is sure which end of a joint's range is closed. Where a proposal merely differs from the words it stands.
"""

from dataclasses import dataclass

from asset2sim.models.language.lexicon import segments
from asset2sim.models.language.object_info import JointInfo, ObjectInfo
from asset2sim.models.language.parts import parts_of
from asset2sim.models.language.sizing import identify
from asset2sim.models.language.states import asked_states
from asset2sim.validation.notes import Notes
from schemas.overlay import Overlay
from schemas.settings import PhysicsSettings

NEAR_END = 0.4
"""Share of the way from an end up to which words put a part near that end; in the middle neither end is wrong."""
BEYOND = 0.05
"""How far beyond an end, as a share of the way, a position still counts as on the way: prompts and models round."""

UPRIGHT = 0.9
"""Height of a slide's unit axis from which one of its ends is plainly up."""

WHOLE = "state: object "
"""How the parser's note begins where words ask a state of the object without naming a part that is known."""


@dataclass(frozen=True)
class Wanted:
    """A joint's state by the words: ``share`` of the way from closed to open, and the position, rad or m at the
    authored scale. ``by_name`` is whether they name the part, or only ask it of the whole object ("an open box")."""

    joint: JointInfo
    share: float
    position: float
    by_name: bool


def with_asked_state(
    info: ObjectInfo, guidance: str, overlay: Overlay, settings: PhysicsSettings, notes: Notes
) -> Overlay:
    """The overlay whose initial positions do not contradict what the words clearly say; a finding for each change."""
    named, wanted = read_states(info, guidance, overlay.scale, settings)
    positions, asked = dict(overlay.initial_joint_positions), list(overlay.asked)
    joints = {joint.name: joint for joint in info.joints}
    stray = [name for name in positions if name in asked and name in joints and name not in named]
    for name, want in wanted.items():
        if name not in positions and not want.by_name:
            continue
        if name not in positions:
            source = stray.pop(0) if stray else None
            positions[name] = given_to(want, None if source is None else (joints[source], positions[source]), notes)
            asked.append(name)
            if source is not None:
                del positions[source]
                asked.remove(source)
        positions[name] = from_right_end(want, positions[name], notes)
    if positions == overlay.initial_joint_positions:
        return overlay
    return overlay.model_copy(update={"initial_joint_positions": positions, "asked": tuple(asked)})


def read_states(
    info: ObjectInfo, guidance: str, scale: float, settings: PhysicsSettings
) -> tuple[frozenset[str], dict[str, Wanted]]:
    """The joints that the words name, and of these the ones of which words and geometry are clear.

    No joint counts as clear where the words ask a state of a part that the object does not have, as far as one can
    tell: the words then mean something by a name that is not known here.
    """
    size, _ = identify(info, guidance)
    asked = asked_states(info, parts_of(info, size.category), segments(guidance, size.category), scale)
    joints = {joint.name: joint for joint in info.joints}
    wanted: dict[str, Wanted] = {}
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
            wanted[name] = Wanted(joint, share_of(joint, position), position, not whole)
    return frozenset(asked.positions), wanted


def given_to(want: Wanted, stray: tuple[JointInfo, float] | None, notes: Notes) -> float:
    """The position of a joint that the words name and the proposal leaves out, or gives to another (``stray``)."""
    name = want.joint.name
    if stray is None:
        notes.warn(
            "state_missing",
            f"joint '{name}': the user's words ask a state of it, and the proposal has none; set to "
            f"{want.position:.4g}, {want.share:.0%} open",
            joint=name,
            value=None,
            limit=want.position,
        )
        return want.position
    other, at = stray
    share = min(max(share_of(other, at), 0.0), 1.0) if other.range > 0.0 and other.motion != "spin" else want.share
    position = want.joint.closed + share * (want.joint.open - want.joint.closed)
    notes.warn(
        "state_of_wrong_part",
        f"joint '{name}': the proposal gives the state that the user's words ask of it to joint '{other.name}', which "
        f"they do not name; moved, {share:.0%} open",
        joint=name,
        value=at,
        limit=position,
    )
    return position


def from_right_end(want: Wanted, at: float, notes: Notes) -> float:
    """The position, counted from the other end where it lies at the opposite end of what the words say."""
    share = share_of(want.joint, at)
    wrong = (want.share <= NEAR_END and 1.0 - NEAR_END <= share <= 1.0 + BEYOND) or (
        want.share >= 1.0 - NEAR_END and -BEYOND <= share <= NEAR_END
    )
    if not wrong:
        return at
    mirrored = want.joint.closed + want.joint.open - at
    notes.warn(
        "state_at_wrong_end",
        f"joint '{want.joint.name}': {at:.4g} is {share:.0%} open, where the user's words ask for {want.share:.0%}; "
        f"counted from the other end it is {mirrored:.4g}, {1.0 - share:.0%} open",
        joint=want.joint.name,
        value=at,
        limit=mirrored,
    )
    return mirrored


def share_of(joint: JointInfo, at: float) -> float:
    """How far a position is on the way from closed (0) to open (1)."""
    return (at - joint.closed) / (joint.open - joint.closed)
