"""Where a gripper takes hold of an object from above, to lift it into a bowl, found by rays from geometry alone."""

import math
from collections.abc import Iterator
from itertools import pairwise, product

import numpy as np

from asset2sim.gym.arm.grasps import ROOM_M, material_between, opened_for
from asset2sim.gym.arm.paths import ToolPath, vertices
from asset2sim.gym.arm.scene import CompiledScene
from asset2sim.gym.world import welded_bodies
from asset2sim.physics.arrays import Array
from lab.trials.scene import Bowl

DIRECTIONS = 8
"""Directions along which the fingers may close, over half a turn."""
SPREAD = (0.0, 0.15, -0.15, 0.3, -0.3, 0.42, -0.42)
"""Where over the object a hold is looked for, shares of its extent from its middle."""
DEPTHS_M = (0.035, 0.02, 0.012)
"""How far below the top of what is there the finger tips reach, m, deepest first."""
LIFT_M, ABOVE_BOWL_M = 0.12, 0.04
"""How high the object is lifted, and how far its lowest point stays above the bowl's rim until it is let go of."""
LOOSE_COST = 0.2
"""Metres of width that a hold of the heaviest part is worth over one of a lid or a handle, which gives way."""
CENTER_WEIGHT = 0.6
"""Metres of width that a metre of distance from the centre of mass is worth: a hold off the middle turns the object."""


def grasp_paths(stage: CompiledScene, bowl: Bowl) -> Iterator[ToolPath]:
    """Ways to lift the object into the bowl, each with another hold, the narrowest and nearest to its centre of mass
    first. None where nothing of it fits between the fingers."""
    points = vertices(stage, frozenset(stage.bodies))
    mass = stage.model.body_mass[stage.bodies]
    center = mass @ stage.data.xipos[stage.bodies] / mass.sum()
    low, high = points.min(axis=0), points.max(axis=0)
    groups = [welded_bodies(stage.model, body) for body in stage.bodies]
    heavy = max(groups, key=lambda group: float(stage.model.body_mass[sorted(group)].sum()))
    found = []
    for x, y in product(SPREAD, SPREAD):
        at = np.array([*((low + high) / 2.0)[:2] + np.array([x, y]) * (high - low)[:2], high[2]])
        at[:2] = center[:2] if x == y == 0.0 else at[:2]
        top = height_at(stage, at, high[2] + 0.1)
        for depth, turn in product(DEPTHS_M, range(DIRECTIONS)) if top > 0.0 else ():
            across = np.array([math.cos(math.pi * turn / DIRECTIONS), math.sin(math.pi * turn / DIRECTIONS), 0.0])
            hold = np.array([at[0], at[1], max(top - depth, stage.gripper.lowest_m)])
            span = material_between(stage, hold, across, heavy, np.array([0.0, 0.0, 1.0]))
            if (
                span is not None
                and span[1] - span[0] <= stage.gripper.opening_m - 2.0 * ROOM_M
                and top - hold[2] > 0.004
            ):
                held = hold + across * (span[0] + span[1]) / 2.0
                off = float(np.linalg.norm(held[:2] - center[:2]))
                cost = span[1] - span[0] + CENTER_WEIGHT * off - 0.3 * depth + (0.0 if span[2] else LOOSE_COST)
                found.append((cost, held, across, span[1] - span[0]))
    for _, held, across, width in sorted(found, key=lambda item: item[0]):
        yield lift_path(held, across, opened_for(stage, width), bowl, float(held[2] - low[2]), float(high[2]))


def height_at(stage: CompiledScene, at: Array, top: float) -> float:
    """Height of what is seen from above at a place, m; zero where that is the floor."""
    source = np.array([at[0], at[1], top])
    distance, geom = stage.first_met(source, np.array([0.0, 0.0, -1.0]))
    return float(source[2] - distance) if distance < math.inf and stage.object_geoms[geom] else 0.0


def lift_path(held: Array, across: Array, open_m: float, bowl: Bowl, below: float, top: float) -> ToolPath:
    """The way of one hold: down to it, close, up, over the bowl, down, open, up. ``below`` is how far the object
    reaches below the hold, m."""
    up = np.array([0.0, 0.0, 1.0])
    aloft = max(held[2] + LIFT_M, bowl.height_m + below + ABOVE_BOWL_M)
    over = np.array([bowl.at[0], bowl.at[1], aloft])
    lowered = np.array([bowl.at[0], bowl.at[1], max(below + 0.02, held[2])])
    raised = held * np.array([1.0, 1.0, 0.0]) + up * aloft
    first = held + up * max(0.05, top - held[2] + 0.03)
    stops: list[tuple[Array, float, str]] = [
        (first, open_m, "approach"), (held, open_m, "approach"), (held, 0.0, "grip"), (raised, 0.0, "lift"),
        (over, 0.0, "carry"), (lowered, 0.0, "lower"), (lowered, open_m, "release"),
        (lowered + up * 0.12, open_m, "retreat"),
    ]  # fmt: skip
    points, opening, phases = [stops[0][0]], [stops[0][1]], [stops[0][2]]
    for before, after in pairwise(stops):
        count = max(1, math.ceil(float(np.linalg.norm(after[0] - before[0])) / 0.03))
        for share in np.linspace(0.0, 1.0, count + 1)[1:]:
            points.append(before[0] + share * (after[0] - before[0]))
            opening.append(before[1] + share * (after[1] - before[1]))
            phases.append(after[2])
    axes = np.tile(-up, (len(points), 1))
    return ToolPath(
        np.array(points),
        axes,
        np.tile(across, (len(points), 1)),
        np.array(opening),
        tuple(phases),
        np.zeros(len(points)),
    )
