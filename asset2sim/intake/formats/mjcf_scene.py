"""Geoms of an MJCF that are its scene and no part of its objects: ground, and the floor or table that they stand on."""

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from asset2sim.physics.arrays import Array

FLOOR = re.compile(r"(?<![a-z])(floor|ground|table(top|link)?|workbench)(?![a-z])")
RIM = re.compile(r"(?<![a-z])([a-z]*walls?|fence|rim|border)(?![a-z])")
SCENE = "the floor or table under all else"
"""Words for a floor or table that is left out, by which its note is known again."""
CORNERS = ("ext_p0", "ext_px", "ext_py", "ext_pz")
"""Sites at a fixture's corners, from which RoboCasa's loader scales it to the edges that a kitchen has for it."""
TOUCHING_M = 0.01
"""Depth to which what stands on a floor may reach into it as it is drawn."""
BESIDE_M = 0.03
"""Gap from which something is apart from what stands beside it, and holds or meets no part of it."""
APART_M = 0.005
"""Gap from which a rim is apart from what it stands round; a door has 2 to 4 mm to its frame."""


@dataclass(frozen=True, eq=False)
class Still:
    """Geoms that stand in the world together, and the (n, 3) corners of their boxes: one ``geom`` of the world itself,
    or a whole ``body`` in which nothing moves."""

    kind: str
    name: str
    geoms: tuple[int, ...]
    low: Array
    high: Array

    def left_out(self, why: str) -> str:
        """The note on leaving it out, and ``why``."""
        return f"{self.kind} '{self.name}' is left out: it is {why}"


def ground_of(mujoco: Any, model: Any) -> dict[int, str]:
    """Geom → what is to be said of leaving it out: every plane and height field, of which nothing is said in the world
    itself; what stands still, is called a floor, ground or table, and lies under all else but what motors move; and
    what is called a wall or rim and stands on such round all else. A geom of the world itself must reach beyond all
    else on every side, as floors do that are drawn as boxes; a body must lie under the middle of what moves."""
    endless = {int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD)}
    planes = [geom for geom in range(model.ngeom) if model.geom_type[geom] in endless]
    found = {geom: "its planes and height fields are left out" if model.geom_bodyid[geom] else "" for geom in planes}
    solid = [geom for geom in range(model.ngeom) if geom not in found]
    low, high = boxes_of(mujoco, model)
    still = list(still_in(mujoco, model, solid, low, high))
    floors, rims = ([item for item in still if word.search(item.name.lower())] for word in (FLOOR, RIM))
    motors = model.actuator_trnid[model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT), 0]
    driven = set(model.body_rootid[model.jnt_bodyid[motors]].tolist())
    things = [geom for geom in solid if geom not in {geom for floor in floors for geom in floor.geoms}]
    things = [geom for geom in things if model.body_rootid[model.geom_bodyid[geom]] not in driven] or things
    if not floors or not things:
        return found
    moving = any(model.body_weldid[model.geom_bodyid[geom]] for geom in things)
    least, most = low[things].min(axis=0), high[things].max(axis=0)
    beneath = [item for item in floors if is_beneath(item, least, most, moving)]
    top = min((item.high[:, 2].max() for item in beneath), default=-np.inf)
    beneath += [item for item in floors if item not in beneath and item.high[:, 2].max() <= top + TOUCHING_M]  # legs
    found |= {geom: item.left_out(SCENE) for item in beneath for geom in item.geoms}
    flat = [item for item in still if item.kind == "geom" and item.high[:, 2].max() <= top + TOUCHING_M]
    marks = [item for item in flat if item not in beneath and not touches(model, item.geoms[0])]
    found |= {geom: item.left_out("only drawn, on what is left out") for item in marks for geom in item.geoms}
    things = [geom for geom in things if geom not in found]
    things = [geom for geom in things if geom not in {geom for rim in rims for geom in rim.geoms}]
    if beneath and things:
        least, most = low[things].min(axis=0), high[things].max(axis=0)
        around = [rim for rim in rims if is_around(rim, least, most) and rim.low[:, 2].min() >= top - TOUCHING_M]
        found |= {geom: rim.left_out("round all else on what is left out") for rim in around for geom in rim.geoms}
    return found


def beside(mujoco: Any, model: Any, ground: Collection[int], led: Collection[int]) -> list[Still]:
    """Geoms and bodies that stand still in the world apart from the one thing that moves, which stands there by shapes
    of its own, and from all that touches it: piles beside a digger, a bin beside a drawer."""
    tops = {int(top) for top in model.body_rootid[model.jnt_bodyid[model.jnt_type != int(mujoco.mjtJoint.mjJNT_FREE)]]}
    parts = [geom for geom in range(model.ngeom) if geom not in ground]
    own = [geom for geom in parts if model.body_rootid[model.geom_bodyid[geom]] in tops.difference(led)]
    if len(tops.difference(led)) != 1 or all(model.body_weldid[model.geom_bodyid[geom]] for geom in own):
        return []
    low, high = boxes_of(mujoco, model)
    rest, least, most = list(still_in(mujoco, model, parts, low, high)), low[own], high[own]
    while near := [item for item in rest if comes_near(item, least, most)]:
        least = np.vstack([least, *(item.low for item in near)])
        most = np.vstack([most, *(item.high for item in near)])
        rest = [item for item in rest if item not in near]
    return rest


def comes_near(item: Still, least: Array, most: Array) -> bool:
    """Whether a box of an item comes near one of those between these (n, 3) corners."""
    gaps = np.maximum(item.low[:, None] - most, least - item.high[:, None])
    return bool(np.any(gaps.max(axis=2) <= BESIDE_M))


def is_sized(mujoco: Any, model: Any) -> bool:
    """Whether sites mark an object's corners, from which a loader brings it to another size."""
    sites = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name) for name in CORNERS]
    return min(sites) >= 0 and bool(np.ptp(model.site_pos[sites], axis=0).min() > 0.0)


def touches(model: Any, geom: int) -> bool:
    """Whether a geom collides with anything."""
    return bool(model.geom_contype[geom] or model.geom_conaffinity[geom])


def is_beneath(floor: Still, least: Array, most: Array, moving: bool) -> bool:
    """Whether a floor or table lies under a box from ``least`` to ``most``, in which something is ``moving``."""
    if floor.kind == "body":
        least_over = most_over = (least + most) / 2.0
    else:
        least_over, most_over = least, most
    low, high = floor.low.min(axis=0), floor.high.max(axis=0)
    under = bool(np.all(low[:2] < least_over[:2]) and np.all(high[:2] > most_over[:2]))
    return under and bool(high[2] <= least[2] + TOUCHING_M) and (moving or floor.kind == "geom")


def is_around(rim: Still, least: Array, most: Array) -> bool:
    """Whether a rim stands on all sides of a box from ``least`` to ``most``, and most of its pieces apart from it:
    those of a door's wall touch the door."""
    apart = np.any((rim.low > most + APART_M) | (rim.high < least - APART_M), axis=1)
    low, high = rim.low.min(axis=0), rim.high.max(axis=0)
    return bool(np.all(low[:2] < least[:2]) and np.all(high[:2] > most[:2]) and apart.mean() > 0.5)


def boxes_of(mujoco: Any, model: Any) -> tuple[Array, Array]:
    """The least and the greatest corners of the geoms' boxes in the world, (n, 3) each, as the model is drawn."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    turn = data.geom_xmat.reshape(-1, 3, 3)
    middle = data.geom_xpos + np.einsum("gij,gj->gi", turn, model.geom_aabb[:, :3])
    half = np.einsum("gij,gj->gi", np.abs(turn), model.geom_aabb[:, 3:])
    low, high = middle - half, middle + half
    # A mesh lies in the frame of its inertia, in which its box may be much larger than it is.
    for geom in np.flatnonzero(model.geom_type == int(mujoco.mjtGeom.mjGEOM_MESH)):
        mesh = model.geom_dataid[geom]
        start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        seen = model.mesh_vert[start : start + count] @ turn[geom].T + data.geom_xpos[geom]
        low[geom], high[geom] = seen.min(axis=0), seen.max(axis=0)
    return low, high


def still_in(mujoco: Any, model: Any, solid: Sequence[int], low: Array, high: Array) -> Iterator[Still]:
    """All that stands still in the world: its own geoms, and the bodies there in and on which nothing moves."""
    kinds = mujoco.mjtObj
    for geom in solid:
        if not model.geom_bodyid[geom]:
            name = mujoco.mj_id2name(model, kinds.mjOBJ_GEOM, geom) or ""
            yield Still("geom", name, (geom,), low[[geom]], high[[geom]])
    moved = {int(model.body_rootid[body]) for body in range(1, model.nbody) if model.body_weldid[body]}
    for body in range(1, model.nbody):
        if model.body_parentid[body] == 0 and body not in moved:
            own = [geom for geom in solid if model.body_rootid[model.geom_bodyid[geom]] == body]
            name = mujoco.mj_id2name(model, kinds.mjOBJ_BODY, body) or ""
            if own:
                yield Still("body", name, tuple(own), low[own], high[own])
