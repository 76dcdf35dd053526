"""Geoms of an MJCF that are the ground and no part of its objects, and links that it lets pass through each other: by
the bits of its geoms, its exclusions, or having no contacts."""

import re
from collections.abc import Collection, Mapping
from itertools import combinations
from typing import Any

import numpy as np

NO_BITS = (0, 0)


def masks_of(model: Any, links: Mapping[int, str], ground: Collection[int]) -> dict[str, tuple[int, int]]:
    """Link → the bits of all its shapes, contype and conaffinity; both 0 where it collides with nothing. ``links``
    names the bodies, ``ground`` the geoms that are no part of an object."""
    found = dict[str, tuple[int, int]]()
    for geom in range(model.ngeom):
        if geom not in ground:
            name = links[int(model.geom_bodyid[geom])]
            kind, reach = found.get(name, NO_BITS)
            found[name] = kind | int(model.geom_contype[geom]), reach | int(model.geom_conaffinity[geom])
    return found


def let_pass(
    mujoco: Any, model: Any, links: Mapping[int, str], masks: Mapping[str, tuple[int, int]]
) -> list[tuple[str, str]]:
    """Pairs of links that the file lets pass through each other, of which engines let a link pass its parent alone: all
    where it switches contacts off; those that it excludes; those whose bits do not meet, if either has any. Of two
    without bits nothing is said: they have no collision shapes, and pass where one is fixed to what the other moves in.
    """
    off = mujoco.mjtDisableBit
    contactless = bool(model.opt.disableflags & (int(off.mjDSBL_CONTACT) | int(off.mjDSBL_CONSTRAINT)))
    excluded = {divmod(int(pair), 1 << 16) for pair in model.exclude_signature}
    found = []
    for first, second in combinations([body for body, name in links.items() if name in masks], 2):
        own, other = masks[links[first]], masks[links[second]]
        apart = not (own[0] & other[1] or other[0] & own[1])
        if own == other == NO_BITS:
            apart = in_one_frame(model, first, second)
        stated = contactless or {(first, second), (second, first)} & excluded
        if (stated or apart) and not are_adjoining(model, first, second):
            found.append((links[first], links[second]))
    return found


def are_adjoining(model: Any, first: int, second: int) -> bool:
    """Whether one of two bodies is the other's parent, or both stand still in the world."""
    parents, welds = model.body_parentid, model.body_weldid
    return bool(parents[first] == second or parents[second] == first or not (welds[first] or welds[second]))


def in_one_frame(model: Any, first: int, second: int) -> bool:
    """Whether one of two bodies is fixed to what the other moves in."""
    welds, parents = model.body_weldid, model.body_parentid
    held = {body: int(welds[parents[welds[body]]]) if welds[body] else -1 for body in (first, second)}
    return bool(held[first] == welds[second] or held[second] == welds[first])


FLOOR = re.compile(r"(?<![a-z])(floor|ground|table(top)?|workbench)(?![a-z])")
TOUCHING_M = 0.01
"""Depth to which what stands on a floor may reach into it as it is drawn."""


def ground_of(mujoco: Any, model: Any) -> dict[int, str]:
    """Geom → what is to be said of leaving it out: every plane and height field, of which nothing is said in the world
    itself; and what stands there, is called a floor, ground or table, lies under all else but what motors move, and
    reaches beyond it on every side, as floors that are drawn as boxes do and tables of scenes."""
    endless = {int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD)}
    planes = [geom for geom in range(model.ngeom) if model.geom_type[geom] in endless]
    found = {geom: "its planes and height fields are left out" if model.geom_bodyid[geom] else "" for geom in planes}
    solid = [geom for geom in range(model.ngeom) if geom not in found]
    names = {geom: mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom) or "" for geom in solid}
    named = [geom for geom in solid if not model.geom_bodyid[geom] and FLOOR.search(names[geom].lower())]
    if not named or len(named) == len(solid):
        return found
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    turn = data.geom_xmat.reshape(-1, 3, 3)
    middle = data.geom_xpos + np.einsum("gij,gj->gi", turn, model.geom_aabb[:, :3])
    half = np.einsum("gij,gj->gi", np.abs(turn), model.geom_aabb[:, 3:])
    motors = model.actuator_trnid[model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT), 0]
    driven = set(model.body_rootid[model.jnt_bodyid[motors]].tolist())
    others = [geom for geom in solid if geom not in named]
    others = [geom for geom in others if model.body_rootid[model.geom_bodyid[geom]] not in driven] or others
    low, high = (middle - half)[others].min(axis=0), (middle + half)[others].max(axis=0)
    for geom in named:
        beyond = (middle - half)[geom][:2] < low[:2], (middle + half)[geom][:2] > high[:2]
        if np.all(beyond) and (middle + half)[geom][2] <= low[2] + TOUCHING_M:
            found[geom] = f"geom '{names[geom]}' is left out: it is the floor or table under all else"
    return found
