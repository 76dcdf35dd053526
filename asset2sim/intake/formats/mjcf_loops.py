"""Loops that MuJoCo's connects and welds close, as ties of their joints: a URDF is a tree, in which a mechanism of one
freedom is one joint that the others follow."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from asset2sim.intake.formats.mjcf_ties import Tie, joints_above
from asset2sim.physics.arrays import Array

STEPS = 24
"""Positions of the leading joint on either side of where it is drawn, at which the loop is closed."""
TURN_RAD = 1.0
"""Way to either side of a hinge without limits; of a slide as a share of the model's size."""
CLOSED, SOLVED = 1e-3, 1e-8
"""Gap of a loop that is closed as it is drawn, and how near to it it is kept, as shares of the model's size."""
STILL = 1e-3
"""Share of the leading joint's way below which one does not move."""
LOOSE = 0.03
"""Gap, as a share of the model's size, from which joints are held rather than tied: a straight line misses the way."""


@dataclass(frozen=True)
class Loops:
    """The loops of a model as ties of their joints, a note on each, the equalities that these say, and pairs of
    bodies that go through one another."""

    ties: list[Tie]
    notes: list[str]
    said: set[int]
    apart: set[tuple[int, int]]


def loop_ties(mujoco: Any, model: Any, name: Callable[[int], str]) -> Loops:
    """The loops of one freedom that connects and welds close. Where following in proportion leaves a gap, all of a
    loop's joints but the leading one are held, and what this moves goes through them; all joints of a stiff one are."""
    ties, notes, said, apart = list[Tie](), list[str](), set[int](), set[tuple[int, int]]()
    for equalities, joints in loops(mujoco, model):
        data = mujoco.MjData(model)
        size = max(float(model.stat.extent), 1e-6)
        followed = followers(mujoco, model, data, equalities, joints, size)
        if followed is None:
            continue
        leader, ways = followed
        if len(ways) == 1:
            stiff = ", ".join(f"'{name(joint)}'" for joint in joints)
            notes.append(f"the loop of {stiff} is stiff: they are held")
            ties += [Tie(name(joint), name(joint), 0.0, 0.0) for joint in joints]
            said |= set(equalities)
            continue
        lead = ways[:, joints.index(leader)]
        ratios = lead @ ways / (lead @ lead)
        gap = max(gap_of(mujoco, model, data, equalities, joints, ratios * value) for value in (lead.min(), lead.max()))
        others = [joint for joint in joints if joint != leader]
        names = ", ".join(f"'{name(joint)}'" for joint in others)
        held = gap > LOOSE * size
        how = f"{names} held" if held else f"{names} following in proportion, which leaves {1000 * gap:.2g} mm"
        notes.append(f"the loop that '{name(leader)}' moves is no tree, as a URDF is: {how}")
        for joint, ratio in zip(joints, ratios.tolist(), strict=True):
            if joint != leader:
                rigid = held or abs(ratio) < STILL
                ties.append(Tie(name(joint), name(joint if rigid else leader), 0.0 if rigid else ratio, 0.0))
        said |= set(equalities)
        if held:
            rigid_bodies = {body for joint in others for body in bodies_below(model, joint)}
            apart |= {(body, other) for body in {*bodies_below(model, leader)} - rigid_bodies for other in rigid_bodies}
    return Loops(ties, notes, said, apart)


def loops(mujoco: Any, model: Any) -> list[tuple[list[int], list[int]]]:
    """The connects and welds that close loops of hinges and slides, with these joints; those with a joint in common are
    one."""
    closes = {int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)}
    simple = {int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)}
    found = list[tuple[list[int], list[int]]]()
    for equality in range(model.neq):
        if int(model.eq_type[equality]) not in closes or not model.eq_active0[equality]:
            continue
        first, second = (joints_above(model, body_of(mujoco, model, equality, end)) for end in (0, 1))
        joints = first ^ second
        if not joints or not {int(model.jnt_type[joint]) for joint in joints} <= simple:
            continue
        same = [item for item in found if joints & set(item[1])]
        found = [item for item in found if item not in same]
        together = [equality, *(number for item in same for number in item[0])]
        found.append((together, sorted(joints.union(*(item[1] for item in same)))))
    return found


def body_of(mujoco: Any, model: Any, equality: int, end: int) -> int:
    """The body at an end of a connect or weld, which names bodies or sites."""
    number = int((model.eq_obj1id, model.eq_obj2id)[end][equality])
    return int(model.site_bodyid[number]) if model.eq_objtype[equality] == mujoco.mjtObj.mjOBJ_SITE else number


def bodies_below(model: Any, joint: int) -> list[int]:
    """The bodies that a joint moves."""
    return [body for body in range(1, model.nbody) if joint in joints_above(model, body)]


def followers(
    mujoco: Any, model: Any, data: Any, equalities: Sequence[int], joints: Sequence[int], size: float
) -> tuple[int, Array] | None:
    """The joint that leads a loop (one with limits first, then that which carries most), and how far (k, n) all of its
    joints are from where they are drawn at k positions of that one, of a stiff loop the drawn one alone; None where the
    loop is open as drawn, or of several freedoms."""
    drawn = np.zeros(len(joints))
    first = gaps(mujoco, model, data, equalities, joints, drawn)
    if np.abs(first).max() > CLOSED * size:
        return None
    _, values, turned = np.linalg.svd(slopes(mujoco, model, data, equalities, joints, drawn))
    freedoms = len(joints) - int((values > STILL * values[0]).sum())
    if freedoms != 1:
        return (joints[0], drawn[None]) if freedoms == 0 else None
    moving = [joint for joint, share in zip(joints, turned[-1].tolist(), strict=True) if abs(share) > STILL]
    # Of a door and the rods of its closer the door leads.
    leader = max(moving, key=lambda joint: (bool(model.jnt_limited[joint]), subtree_mass(model, joint), -joint))
    place, found = joints.index(leader), [drawn]
    slide = model.jnt_type[leader] == mujoco.mjtJoint.mjJNT_SLIDE
    most = TURN_RAD * (size if slide else 1.0)
    zero = float(model.qpos0[model.jnt_qposadr[leader]])
    lower, upper = model.jnt_range[leader] - zero if model.jnt_limited[leader] else (-most, most)
    free = [index for index in range(len(joints)) if index != place]
    for end in (float(lower), float(upper)):
        at = drawn
        for value in np.linspace(0.0, end, STEPS + 1)[1:]:
            at = at.copy()
            at[place] = value
            for _ in range(STEPS):
                wide = gaps(mujoco, model, data, equalities, joints, at) - first
                if np.abs(wide).max() < SOLVED * size:
                    break
                at[free] -= np.linalg.lstsq(
                    slopes(mujoco, model, data, equalities, joints, at)[:, free], wide, rcond=1e-6
                )[0]
            else:
                break  # the loop goes no further
            found.append(at)
    return (leader, np.array(found)) if len(found) > 1 else None


def subtree_mass(model: Any, joint: int) -> float:
    """Mass that a joint carries, kg, as MuJoCo compiled it."""
    return float(model.body_subtreemass[model.jnt_bodyid[joint]])


def gaps(mujoco: Any, model: Any, data: Any, equalities: Sequence[int], joints: Sequence[int], moved: Array) -> Array:
    """How far the ends of these equalities are apart, m, 3 numbers of a connect and 9 of a weld, with ``joints`` moved
    from where they are drawn."""
    data.qpos[:] = model.qpos0
    data.qpos[model.jnt_qposadr[list(joints)]] += moved
    mujoco.mj_kinematics(model, data)
    return np.concatenate([ends_of(mujoco, model, data, equality).ravel() for equality in equalities])


def ends_of(mujoco: Any, model: Any, data: Any, equality: int) -> Array:
    """(k, 3) the way between the ends of an equality, m: of a weld at its anchor and, as far from it as the model is
    wide, on two axes."""
    items = int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])
    numbers, weld = model.eq_data[equality], model.eq_type[equality] == mujoco.mjtEq.mjEQ_WELD
    corners = model.stat.extent * np.eye(3)[:2] if weld else np.zeros((0, 3))
    if model.eq_objtype[equality] == mujoco.mjtObj.mjOBJ_SITE:
        places = [(data.site_xpos[item], data.site_xmat[item].reshape(3, 3), np.eye(3)) for item in items]
        anchors = np.zeros(3), np.zeros(3)
    else:
        places = [(data.xpos[item], data.xmat[item].reshape(3, 3), np.eye(3)) for item in items]
        anchors = (numbers[3:6], numbers[:3]) if weld else (numbers[:3], numbers[3:6])
        if weld:
            turn = np.zeros(9)
            mujoco.mju_quat2Mat(turn, numbers[6:10])
            places[0] = (*places[0][:2], turn.reshape(3, 3))
    first, second = (
        place + (np.vstack([np.zeros(3), corners]) @ turn.T + anchor) @ frame.T
        for (place, frame, turn), anchor in zip(places, anchors, strict=True)
    )
    return np.asarray(first - second)


def gap_of(mujoco: Any, model: Any, data: Any, equalities: Sequence[int], joints: Sequence[int], moved: Array) -> float:
    """The widest gap of a loop, m."""
    return float(np.abs(gaps(mujoco, model, data, equalities, joints, moved)).max())


def slopes(mujoco: Any, model: Any, data: Any, equalities: Sequence[int], joints: Sequence[int], moved: Array) -> Array:
    """The change of the gaps with each joint, a column each."""
    step = 1e-6
    sides = [[gaps(mujoco, model, data, equalities, joints, moved + sign * step * row) for sign in (1.0, -1.0)]
             for row in np.eye(len(joints))]  # fmt: skip
    return np.stack([(ahead - behind) / (2.0 * step) for ahead, behind in sides], axis=1)
