"""Joints of a USD stage, their numbers in metres, kilograms and radians: one step for each degree of freedom."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from asset2sim.assets.urdf.numbers import BIAS
from asset2sim.intake.formats.format import pose_of
from asset2sim.intake.formats.usd_stage import UsdStage, wxyz
from asset2sim.physics.arrays import Array

if TYPE_CHECKING:
    from pxr import Usd

UNLIMITED = 1e15
"""Limits from which on there is none; Isaac Sim writes the largest float."""
ALONG = 0.98
"""Cosine of the angle between two axes, 11°, above which they are one."""
DEGREE = math.radians(1.0)
AXES = {"X": np.array([1.0, 0.0, 0.0]), "Y": np.array([0.0, 1.0, 0.0]), "Z": np.array([0.0, 0.0, 1.0])}
FREE = (-math.inf, math.inf)
FREEDOMS = ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")
"""Degrees of freedom of a joint that only limits make what it is; where all are free it ties nothing."""


@dataclass(frozen=True, eq=False)
class Step:
    """One degree of freedom of a joint in its own frame: URDF's type, its (3,) axis, and URDF's numbers, ``limit`` and
    ``dynamics``, by the names of their attributes (rad or m, N·m or N)."""

    kind: str
    axis: Array
    limit: dict[str, float]
    dynamics: dict[str, float]


@dataclass(frozen=True, eq=False)
class UsdJoint:
    """A joint between two ``bodies``, paths of prims, of which an empty one is the world; ``frames`` are its (4, 4)
    frames in theirs, ``unscaled`` those of which the positions are not in the scale of what it names. ``mimic``: path
    of the joint that it follows, multiplier and offset. One that is ``spare`` is left out first where joints close a
    loop."""

    name: str
    path: str
    bodies: tuple[str, str]
    frames: tuple[Array, Array]
    unscaled: tuple[Array, Array]
    steps: tuple[Step, ...]
    mimic: tuple[str, float, float] | None
    spare: bool


def read_joints(stage: UsdStage, body_of: Callable[["Usd.Prim"], "Usd.Prim | None"]) -> Iterator[UsdJoint]:
    """The enabled joints that tie two bodies, or one to the world. ``body_of``: the body of which a prim is a part.
    Raises AssetError for a joint of a body with itself, or of what is not there."""
    from pxr import UsdPhysics

    prims = list(stage.prims(stage.stage.GetPseudoRoot()))
    in_radians = any(prim.GetAttribute("mjc:compiler:angle").Get() == "radian" for prim in prims)
    for prim in prims:
        joint = UsdPhysics.Joint(prim)
        if not joint or joint.GetJointEnabledAttr().Get(stage.time) is False:
            continue
        steps = tuple(steps_of(stage, prim, 1.0 if in_radians else DEGREE))
        if len(steps) == len(FREEDOMS):
            stage.notes.append(f"joint {prim.GetPath()} ({prim.GetTypeName()}) is left out: a URDF has none like it")
            continue
        (first, frame0, plain0), (second, frame1, plain1) = (end(stage, prim, side, body_of) for side in (0, 1))
        if not first and not second:
            stage.notes.append(f"joint {prim.GetPath()} is left out: both its sides stand still")
            continue
        if first == second:
            problem = f"joint {prim.GetPath()} ties {first} to itself: name two bodies, or remove it"
            raise stage.refused("usd_joint", problem)
        yield UsdJoint(
            name=str(prim.GetDisplayName() or prim.GetName()),
            path=str(prim.GetPath()),
            bodies=(first, second),
            frames=(frame0, frame1),
            unscaled=(plain0, plain1),
            steps=steps or (Step("fixed", AXES["X"], {}, {}),),
            mimic=mimic_of(stage, prim) if len(steps) == 1 else None,
            spare=bool(joint.GetExcludeFromArticulationAttr().Get(stage.time)),
        )


def one_after_another(joints: Sequence[UsdJoint]) -> Iterator[UsdJoint]:
    """The joints, of which hinges and sliders along different axes between the same two bodies follow one another, in
    their order, through bodies of their own: MuJoCo's exporters mean a body of several joints. Leaves of one pin stay
    as they are."""
    single = [joint for joint in joints if len(joint.steps) == 1 and joint.steps[0].kind != "fixed" and not joint.spare]
    chains: dict[tuple[str, str], list[UsdJoint]] = {joint.bodies: [] for joint in single}
    for joint in single:
        if all(unlike(joint, other) for other in chains[joint.bodies]):
            chains[joint.bodies].append(joint)
    for joint in joints:
        first, second = joint.bodies
        chain = chains.get(joint.bodies, [])
        number = next((index for index, item in enumerate(chain) if item is joint), 0)
        if number:
            first = f"{second}/{number}"
        above = joint.frames[1] if number else joint.frames[0]
        if joint in chain[:-1]:
            second = f"{second}/{number + 1}"
        yield replace(joint, bodies=(first, second), frames=(above, joint.frames[1]))


def unlike(one: UsdJoint, other: UsdJoint) -> bool:
    """Whether two joints of one axis between the same bodies are two freedoms."""
    axes = [joint.frames[0][:3, :3] @ joint.steps[0].axis for joint in (one, other)]
    slides = [joint.steps[0].kind == "prismatic" for joint in (one, other)]
    return slides[0] != slides[1] or abs(float(axes[0] @ axes[1])) < ALONG


def end(
    stage: UsdStage, prim: "Usd.Prim", side: int, body_of: Callable[["Usd.Prim"], "Usd.Prim | None"]
) -> tuple[str, Array, Array]:
    """The body at one side of a joint, and the joint's (4, 4) frame in it: positions are in the scale of the prim that
    the joint names, which may be a part of a body, or stand still in the world; last the frame as if they were not."""
    targets = prim.GetRelationship(f"physics:body{side}").GetForwardedTargets()
    named = stage.stage.GetPrimAtPath(targets[0]) if targets else stage.stage.GetPseudoRoot()
    if not named:
        problem = f"joint {prim.GetPath()}: its body{side} {targets[0]} is not there: name a prim of the stage"
        raise stage.refused("usd_joint", problem)
    at = prim.GetAttribute(f"physics:localPos{side}").Get(stage.time) or (0.0, 0.0, 0.0)
    turn = prim.GetAttribute(f"physics:localRot{side}").Get(stage.time)
    found = stage.rigid(named) @ pose_of(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]) if turn is None else wxyz(turn))
    plain = found.copy()
    plain[:3, 3] = (stage.rigid(named) @ [*(stage.metre * np.asarray(at)), 1.0])[:3]
    found[:3, 3] = (stage.world(named) @ [*at, 1.0])[:3]
    if not np.isfinite(found).all():
        raise stage.refused("usd_number", f"the frame of joint {prim.GetPath()} at body{side} is not finite: mend it")
    body = body_of(named)
    if body is None:
        return "", found, plain
    into = np.linalg.inv(stage.rigid(body))
    return str(body.GetPath()), into @ found, into @ plain


def steps_of(stage: UsdStage, prim: "Usd.Prim", angle: float) -> Iterator[Step]:
    """The degrees of freedom of a joint, the outermost first; none for one that is fixed, all for one that ties
    nothing. ``angle`` is the unit of MuJoCo's own angles, rad."""
    from pxr import UsdPhysics

    first = stage.axis(prim, "physics:axis", "X")
    if prim.IsA(UsdPhysics.RevoluteJoint) or prim.IsA(UsdPhysics.PrismaticJoint):
        ends = ends_of(stage, prim, "physics:lowerLimit", "physics:upperLimit")
        words = ("angular", "rotX") if prim.IsA(UsdPhysics.RevoluteJoint) else ("linear", "transX")
        yield step(stage, prim, words, AXES[first], ends, angle)
    elif prim.IsA(UsdPhysics.SphericalJoint):
        stage.notes.append(f"ball joint {prim.GetPath()} is three hinges")
        # A cone from the axis towards the next one is a turn about the one after that.
        for further, cone in ((2, "0"), (1, "1"), (0, "")):
            name = "XYZ"[("XYZ".index(first) + further) % 3]
            most = stage.number(prim, f"physics:coneAngle{cone}Limit", default=-1.0)
            yield step(
                stage, prim, (f"rot{name}", "angular"), AXES[name], (-most, most) if most >= 0.0 else FREE, angle
            )
    elif prim.IsA(UsdPhysics.DistanceJoint) or prim.GetTypeName() not in ("PhysicsJoint", "PhysicsFixedJoint"):
        yield from [Step("floating", AXES["X"], {}, {})] * len(FREEDOMS)
    elif not prim.IsA(UsdPhysics.FixedJoint):
        for name in FREEDOMS:
            ends = ends_of(stage, prim, f"limit:{name}:physics:low", f"limit:{name}:physics:high")
            if ends[0] < ends[1] or ends[0] == ends[1] != 0.0:  # from 0 to 0 is as locked as the wrong way round
                yield step(stage, prim, (name,), AXES[name[-1]], ends, angle)


def ends_of(stage: UsdStage, prim: "Usd.Prim", low: str, high: str) -> tuple[float, float]:
    """Limits as they are authored, infinite where they are not."""
    return stage.number(prim, low, default=FREE[0]), stage.number(prim, high, default=FREE[1])


def step(
    stage: UsdStage, prim: "Usd.Prim", words: Sequence[str], axis: Array, ends: tuple[float, float], angle: float
) -> Step:
    """One degree of freedom: its ``ends`` in degrees or the stage's lengths. ``words`` are the names by which drives
    and PhysX may have it. A drive is taken for the spring and damper that it is."""
    turns = words[0].startswith(("ang", "rot"))
    kg, metre = stage.kilogram, stage.metre
    inertia, force, unit = (kg * metre**2, kg * metre**2, DEGREE) if turns else (kg, kg * metre, metre)
    per_unit = inertia / unit if turns else kg

    def number(*names: str, default: float = 0.0) -> float:
        every = [name.format(word) for name in names for word in words]
        return stage.number(prim, *dict.fromkeys(every), default=default)

    zero = stage.number(prim, "mjc:ref") * (angle if turns else metre)
    bounded = [abs(value) < UNLIMITED for value in ends]
    limit = dict[str, float]()
    if all(bounded):
        limit = {"lower": ends[0] * unit - zero, "upper": ends[1] * unit - zero}
    elif any(bounded):
        stage.notes.append(f"joint {prim.GetPath()} is limited on one side alone, which a URDF cannot say")
    most = {"effort": number("drive:{}:physics:maxForce") * force,
            "velocity": stage.number(prim, "physxJoint:maxJointVelocity") * unit}  # fmt: skip
    limit |= {key: value for key, value in most.items() if 0.0 < value < UNLIMITED * unit}
    drive = 1.0
    if any(prim.GetAttribute(f"drive:{word}:physics:type").Get(stage.time) == "acceleration" for word in words):
        drive = 0.0
        stage.notes.append(f"the drive of {prim.GetPath()} is an acceleration, which a URDF cannot say: it is left out")
    stiffness = drive * number("drive:{}:physics:stiffness") * per_unit
    reference = number("drive:{}:physics:targetPosition") * unit
    if not stiffness:
        stiffness = stage.number(prim, "mjc:stiffness") * inertia
        reference = stage.number(prim, "mjc:springref") * (angle if turns else metre) - zero
    passive = stage.number(prim, "newton:damping", default=math.nan) * per_unit
    if math.isnan(passive):
        passive = stage.number(prim, "mjc:damping") * inertia
    if stage.number(prim, "physxJoint:jointFriction") > 0.0:
        stage.notes.append(f"the friction coefficient of {prim.GetPath()}, which has no unit, is left out")
    friction = ("newton:friction", "mjc:frictionloss", "physxJointAxis:{}:staticFrictionEffort",
                "physxJointAxis:{}:dynamicFrictionEffort")  # fmt: skip
    armature = ("newton:armature", "mjc:armature", "physxJointAxis:{}:armature", "physxJoint:armature")
    dynamics = {
        "damping": drive * number("drive:{}:physics:damping") * per_unit + passive,
        "friction": number(*friction) * force,
        "spring_stiffness": stiffness,
        "spring_reference": reference if stiffness else 0.0,
        "armature": number(*armature) * inertia,
    }
    # Our own exports': of a mechanism besides the spring, in rad, metres, N·m and N.
    bias = {key: stage.number(prim, f"asset2sim:{key}") for key in BIAS}
    dynamics |= bias | ({"bias_none_at": bias["bias_none_at"] - zero} if bias["bias_slope"] else {})
    start = number("state:{}:physics:position", default=math.nan) * unit
    kind = ("revolute" if "lower" in limit else "continuous") if turns else "prismatic"
    stated = {key: value for key, value in dynamics.items() if value}
    return Step(kind, axis, limit, stated if math.isnan(start) else stated | {"start": start - zero})


def pass_each_other(bodies: Mapping[str, "Usd.Prim"]) -> Iterator[tuple[str, str]]:
    """Pairs of paths of bodies that the stage keeps from colliding."""
    for path, prim in bodies.items():
        told = prim.GetRelationship("physics:filteredPairs")
        targets = map(str, told.GetForwardedTargets()) if told else ()
        yield from ((path, other) for other in targets if other in bodies and other != path)


def mimic_of(stage: UsdStage, prim: "Usd.Prim") -> tuple[str, float, float] | None:
    """The joint that this one follows, by Newton's attributes, PhysX's or MuJoCo's, with multiplier and offset."""
    for relation in prim.GetRelationships():
        name, targets = relation.GetName(), relation.GetForwardedTargets()
        angle, scope = DEGREE, name.rpartition(":")[0]
        if not targets:
            continue
        if name == "newton:mimicJoint":
            if prim.GetAttribute("newton:mimicEnabled").Get(stage.time) is False:
                continue
            ratio = stage.number(prim, "newton:mimicCoef1", default=1.0)
            offset = stage.number(prim, "newton:mimicCoef0")
        elif name == "mjc:target":
            angle = 1.0
            ratio, offset = stage.number(prim, "mjc:coef1", default=1.0), stage.number(prim, "mjc:coef0")
        elif name.startswith("physxMimicJoint:") and name.endswith(":referenceJoint"):
            ratio, offset = (-stage.number(prim, f"{scope}:{key}") for key in ("gearing", "offset"))
        else:
            continue
        leader = stage.stage.GetPrimAtPath(targets[0])
        if not leader:
            stage.notes.append(f"{prim.GetPath()} follows {targets[0]}, which is not there: it moves freely")
            continue
        own, other = (stage.metre if "Prismatic" in str(item.GetTypeName()) else angle for item in (prim, leader))
        return str(targets[0]), ratio * own / other, offset * own
    return None
