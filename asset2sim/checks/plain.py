"""The plain check: springs as the URDF states them, in PyBullet as anybody would load it, without armature."""

from collections.abc import Mapping

from asset2sim.assets.urdf.document import parsed_root
from asset2sim.checks.declared_check import DeclaredCheck
from asset2sim.checks.mechanism import span_of
from asset2sim.checks.rig import Rig
from asset2sim.checks.watch import capped_reading
from schemas.base import Frozen
from schemas.interaction import Interaction
from schemas.overlay import JointPhysics
from schemas.thresholds import Bound, Thresholds
from schemas.verdict import CheckVerdict, Guide
from schemas.vocabulary import Engine, FailureMode

MODE = FailureMode.add("plain_spring")
BEYOND = Bound(
    "plain_beyond_share", 1.0, "1", "a part that its spring throws beyond its limit by its whole travel is gone"
)
TIMESTEP_S = 1.0 / 240.0
"""PyBullet's own step."""
LET_GO_S = 0.5
"""Time for which a part that is let go of is watched, s."""
GRAVITY_M_S2 = -9.81


class PlainSpring(Frozen):
    """One joint with a spring, let go of at the end that is further from its relaxed position: how far it went beyond
    its limits, as a share of its travel."""

    joint: str
    beyond: float


def measure(rig: Rig) -> dict[str, object]:
    """Every joint whose URDF states a spring, all let go of together, the root held; in PyBullet alone."""
    if rig.engine is not Engine.PYBULLET:
        return {}
    springs = written_springs(rig)
    return {"plain_springs": tuple(let_go(rig, springs)) if springs else ()}


def written_springs(rig: Rig) -> dict[str, tuple[float, float]]:
    """Joint → ``spring_stiffness`` and ``spring_reference`` as the URDF states them, where there is a spring."""
    found = {}
    for element in parsed_root(rig.urdf).iterfind("joint[dynamics]"):
        stated = element.find("dynamics")
        stiffness = float(stated.get("spring_stiffness", 0.0)) if stated is not None else 0.0
        if stated is not None and stiffness > 0.0:
            found[str(element.get("name"))] = (stiffness, float(stated.get("spring_reference", 0.0)))
    return found


def let_go(rig: Rig, springs: Mapping[str, tuple[float, float]]) -> list[PlainSpring]:
    """The records of these springs: each step their force is set as a torque, and nothing else is done."""
    import pybullet  # late: where it is not installed, this check does not run

    from asset2sim.engines.pybullet_object import empty_client

    with empty_client() as client:
        client.setTimeStep(TIMESTEP_S)
        client.setGravity(0.0, 0.0, GRAVITY_M_S2)
        # Its looks weigh nothing, and to read them takes fifty times as long as all else.
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_IGNORE_VISUAL_SHAPES
        body = client.loadURDF(str(rig.urdf), useFixedBase=True, flags=flags)
        places = {client.getJointInfo(body, index)[1].decode(): index for index in range(client.getNumJoints(body))}
        starts = dict(rig.item.start)
        spans = {joint.name: span_of(joint) for joint in rig.item.joints if joint.name in springs}
        for name, (low, high) in spans.items():
            starts[name] = max(low, high, key=lambda end: abs(end - springs[name][1]))
        for name, position in starts.items():
            client.resetJointState(body, places[name], position, 0.0)
            client.setJointMotorControl2(body, places[name], pybullet.VELOCITY_CONTROL, force=0.0)
        beyond = dict.fromkeys(spans, 0.0)
        for _ in range(round(LET_GO_S / TIMESTEP_S)):
            for name in spans:
                stiffness, reference = springs[name]
                force = stiffness * (reference - client.getJointState(body, places[name])[0])
                client.setJointMotorControl2(body, places[name], pybullet.TORQUE_CONTROL, force=force)
            client.stepSimulation()
            for name, (low, high) in spans.items():
                position = client.getJointState(body, places[name])[0]
                beyond[name] = max(beyond[name], max(low - position, position - high) / max(high - low, 1e-9))
    return [PlainSpring(joint=name, beyond=capped_reading(share)) for name, share in beyond.items()]


def judge(seen: Interaction, joints: Mapping[str, JointPhysics], limits: Thresholds) -> list[CheckVerdict]:
    """One verdict a joint with a spring in the URDF."""
    most = limits.of(BEYOND)
    return [
        CheckVerdict(
            MODE,
            item.joint,
            item.beyond <= most,
            item.beyond,
            most,
            f"joint '{item.joint}' let go of in plain PyBullet, its spring as the URDF states it, goes "
            f"{item.beyond:.3g} of its travel beyond its limit: give it a softer spring or a heavier part",
        )
        for item in seen.records("plain_springs", PlainSpring)
    ]


CHECK = DeclaredCheck(
    name="plain",
    modes={
        MODE: Guide(
            "A spring of the URDF throws its part out of its range in a simulator that knows no armature",
            "give the part more mass or travel, or the joint a softer spring",
        )
    },
    done="joints with a spring in the URDF, in PyBullet as it is, each spring set as a torque",
    holds="their parts stay within their limits",
    bounds=(BEYOND,),
    measure=measure,
    judge=judge,
    place=75,
    turn=85,
    planted=("stiffness over the bound",),
)
