"""The paper's eleven tasks in the DROID scene: what is asked, where things stand, and what counts as done; the same for
every method."""

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from asset2sim.gym.arm.gripper import PANDA
from asset2sim.gym.arm.tasks import Verb, range_of
from lab.trials.scene import BOWL_HIGH_M, Bowl
from schemas.overlay import JointPhysics

HINGE_RAD, SLIDE_SHARE = 0.1, 0.05
"""ε of hinges, rad, and of sliders, share of their range: a lid or a door that looks shut in a picture of the size that
the policies see, and the trials' own. The paper has an ε for each task and publishes none."""
SHIFT_M, TURN_RAD = 0.02, 0.087
"""By how much the object's place may differ between trials, m each way and rad each way (5 degrees): a person puts it
back by eye no better."""


@dataclass(frozen=True)
class ProbeTask:
    """One of the tasks. The middle of the object's box stands at ``at``, m, in the frame of the arm's base (x ahead, y
    to its left), or as much further ahead as it needs to stay clear of the arm, turned by ``yaw`` rad about the
    vertical; at 0 its front faces the arm. ``joint`` starts ``start`` open, rad (a slider: share of its range), and
    should end shut; a task without one ends with the object in the bowl. ``gripper`` is the arm's. ``instruction`` is
    what the policy is told and ``motion_prompt`` what a judge of films is told, both letter for letter the paper's."""

    name: str
    asset_id: str
    verb: Verb
    instruction: str
    motion_prompt: str
    at: tuple[float, float]
    yaw: float
    joint: str = ""
    start: float = 0.0
    bowl: Bowl | None = None
    """In the frame of the arm's base."""
    gripper: str = PANDA.name

    def epsilon(self, joint: JointPhysics | None) -> float:
        """How near it must end, rad; of a slider m; of the bowl's middle m."""
        if joint is None:
            assert self.bowl is not None
            return self.bowl.rim_m
        return SLIDE_SHARE * range_of(joint) if joint.type == "prismatic" else HINGE_RAD

    def start_of(self, joint: JointPhysics) -> float:
        """Where the joint starts, rad or m, within the object's own limits."""
        way = self.start * range_of(joint) if joint.type == "prismatic" else min(self.start, range_of(joint))
        return joint.closed + (way if joint.open >= joint.closed else -way)


def paper_tasks() -> Iterator[ProbeTask]:
    """The paper's eleven tasks."""
    with Path(__file__).with_name("paper_tasks.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            bowl = None
            if row["bowl_radius_m"]:
                bowl = Bowl((float(row["bowl_x"]), float(row["bowl_y"])), float(row["bowl_radius_m"]), BOWL_HIGH_M)
            yield ProbeTask(
                row["name"], row["asset_id"], Verb(row["verb"]), row["instruction"], row["motion_prompt"],
                (float(row["x"]), float(row["y"])), math.radians(float(row["yaw_deg"])), row["joint"],
                float(row["start"]), bowl,
            )  # fmt: skip


PAPER11 = MappingProxyType({task.name: task for task in paper_tasks()})
"""By the names that the paper's tables have."""
