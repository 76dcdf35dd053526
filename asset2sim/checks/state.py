"""The state check: a joint of which a position is asked settles near it."""

from collections.abc import Mapping, Sequence

from asset2sim.checks.declared_check import DeclaredCheck
from asset2sim.checks.mechanism import span_of
from asset2sim.checks.rig import Rig
from asset2sim.checks.set_down import Resting
from asset2sim.checks.watch import capped_reading
from schemas.interaction import Interaction, SettledJoint
from schemas.overlay import JointPhysics
from schemas.thresholds import Thresholds
from schemas.verdict import CheckVerdict, Guide
from schemas.vocabulary import FailureMode


def measure(rig: Rig) -> dict[str, object]:
    """Where the joints settle once the object is set down."""
    return {"settled": settled_positions(rig.item.joints, rig.down().resting)}


def settled_positions(joints: Sequence[JointPhysics], resting: Resting) -> tuple[SettledJoint, ...]:
    """Where every joint of which a position is asked has come to rest."""
    found = []
    for joint in joints:
        if joint.asked_position is None:
            continue
        lower, upper = span_of(joint)
        now, way = capped_reading(resting.joints[joint.name]), upper - lower
        share = abs(now - joint.asked_position) / way if way > 0.0 else 0.0
        found.append(SettledJoint(joint=joint.name, asked=joint.asked_position, settled=now, share=share))
    return tuple(found)


def judge(seen: Interaction, joints: Mapping[str, JointPhysics], limits: Thresholds) -> list[CheckVerdict]:
    """One verdict a joint of which a position is asked."""
    return [state_verdict(item, joints[item.joint], seen.engine.value, limits) for item in seen.settled]


def state_verdict(item: SettledJoint, joint: JointPhysics, engine: str, limits: Thresholds) -> CheckVerdict:
    """A joint of which a position is asked must settle near it."""
    unit, limit = joint.unit, limits.state_share
    reason = (
        f"joint '{item.joint}', asked to stand at {item.asked:.4g} {unit}, settles at {item.settled:.4g} in {engine}"
    )
    if item.share <= limit:
        return CheckVerdict(FailureMode.STATE, item.joint, True, item.share, limit, reason)
    reason += f", {item.share:.3g} of its range away; ask for a state in which it rests, or for a joint that holds"
    return CheckVerdict(FailureMode.STATE, item.joint, False, item.share, limit, reason)


CHECK = DeclaredCheck(
    name="state",
    modes={
        FailureMode.STATE: Guide(
            "A joint does not stay where it was asked to: it falls, swings or springs back",
            "ask for a position where gravity leaves it, or say that the part holds (`stiff`, `stays open`)",
        )
    },
    done="the same, every joint of which a position is asked",
    holds="it settles within a tenth of its range of that position",
    bounds=("state_share",),
    measure=measure,
    judge=judge,
    place=20,
    turn=20,
    on_plane=True,
    along=(FailureMode.STANDS,),
    planted=("spring that opens a lid",),
)
