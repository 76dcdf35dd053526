"""Which geoms of an MJCF are the ground that its objects stand on, and no part of them."""

import re
from typing import Any

import numpy as np

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
