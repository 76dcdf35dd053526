"""Scripted probes: an expert that knows the state and follows a planned motion, and the same with noise."""

from collections.abc import Iterator
from itertools import islice

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.probes.scene import OPEN, START, Scene
from asset2sim.trials.franka import Arm
from asset2sim.trials.grasps import grasp_paths
from asset2sim.trials.paths import Path as Way
from asset2sim.trials.paths import push_paths
from asset2sim.trials.planning import HELD_RAD, TILT_RAD, Plan, follow, hand_fits, runs_into, timed, times_of
from asset2sim.trials.scene import place
from asset2sim.trials.tasks import target_of, Task

MOST_WAYS = 150
"""Ways that are tried before a task counts as out of reach."""


def ways_of(scene: Scene) -> Iterator[Way]:
    """Ways of the tool to do the task, best first."""
    stage, joint = scene.stage, scene.joint
    if joint is None:
        assert stage.bowl is not None
        return grasp_paths(stage, stage.bowl)
    return push_paths(stage, joint, joint.closed, scene.task.verb)


def plan_of(scene: Scene) -> Plan | None:
    """The first way that the arm can follow from where it stands without running into anything; None for none."""
    stage, arm, name = scene.stage, Arm(), scene.joint.name if scene.joint is not None else None
    base = stage.base.copy()
    far = np.array([*START, 0.04, 0.04])
    far[1] = -1.6  # out of the rays' way
    place(stage, stage.about_positions, far)
    ways = list(islice(ways_of(scene), MOST_WAYS))
    try:
        for way in ways:
            tilt = TILT_RAD if way.across is None else HELD_RAD
            joints = follow(arm, base, way, range(len(way.points)), tilt)
            if joints is None or (way.across is not None and not hand_fits(stage, arm, way, base, joints[0], tilt)):
                continue
            plan = from_start(timed(arm, base, way, joints), arm)
            if not runs_into(stage, name, way, plan):
                return plan
        return None
    finally:
        place(stage, stage.about_positions, OPEN)


def from_start(plan: Plan, arm: Arm) -> Plan:
    """The plan with DROID's start instead of the trials' own."""
    commands = plan.commands.copy()
    commands[[0, 1, -2, -1], :7] = START
    tools = np.array([arm.tool(row[:7])[0] for row in commands])
    return Plan(plan.base, times_of(tools, commands, plan.phases), commands, plan.phases)
