"""The paper's eleven tasks in the DROID scene: what is asked, where things stand, and what counts as done; the same for
every method."""

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

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
class BowlAt:
    """A bowl: its middle in the frame of the arm's base, m, and its inner radius at the bottom, m."""

    x: float
    y: float
    radius_m: float


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
    bowl: BowlAt | None = None
    gripper: str = PANDA.name

    @property
    def reason(self) -> str:
        """Why its ε is what it is."""
        if self.bowl is not None:
            return "its centre of mass is within the bowl's rim and the hand has let go"
        return "it looks shut: 0.1 rad of a hinge, 5 % of a drawer's way"

    def epsilon(self, joint: JointPhysics | None) -> float:
        """How near it must end, rad; of a slider m; of the bowl's middle m."""
        if joint is None:
            assert self.bowl is not None
            return Bowl((self.bowl.x, self.bowl.y), self.bowl.radius_m, BOWL_HIGH_M).rim_m
        return SLIDE_SHARE * range_of(joint) if joint.type == "prismatic" else HINGE_RAD

    def start_of(self, joint: JointPhysics) -> float:
        """Where the joint starts, rad or m, within the object's own limits."""
        way = self.start * range_of(joint) if joint.type == "prismatic" else min(self.start, range_of(joint))
        return joint.closed + (way if joint.open >= joint.closed else -way)


PAPER11 = MappingProxyType(
    {
        task.name: task
        for task in (
            ProbeTask("stapler press", "103275", Verb.PRESS, "Press down on the stapler.",
                      "The robot tries to press the stapler on the table.",
                      (0.5, 0.0), 0.0, "joint_1", 0.3),
            ProbeTask("stapler grasp", "103275", Verb.GRASP, "Pick up the stapler and put into the bowl.",
                      "The robot tries to pick up the stapler and put it into the bowl.",
                      (0.48, 0.1), 0.0, bowl=BowlAt(0.5, -0.25, 0.12)),
            ProbeTask("box close", "100221", Verb.CLOSE, "Close the box lid.",
                      "The robot tries to close the box.",
                      (0.5, 0.0), 0.0, "joint_0", 0.4),
            ProbeTask("box grasp", "100221", Verb.GRASP, "Pick up the box and put into the bowl.",
                      "The robot tries to pick up the box and put it into the bowl.",
                      (0.48, 0.1), 0.0, bowl=BowlAt(0.5, -0.25, 0.13)),
            ProbeTask("microwave close", "7236", Verb.CLOSE, "Close the microwave door.",
                      "The robot tries to close the microwave door.",
                      (0.55, 0.0), 0.0, "joint_0", 0.8),
            ProbeTask("toilet close", "102703", Verb.CLOSE, "Close the toilet lid.",
                      "The robot tries to close the toilet lid.",
                      (0.5, 0.0), 0.0, "joint_2", 1.6),
            ProbeTask("laptop fold", "9912", Verb.CLOSE, "Close the laptop.",
                      "The robot tries to close the laptop.",
                      (0.5, 0.0), 0.0, "joint_1", 0.5),
            ProbeTask("bag grasp", "101673", Verb.GRASP, "Pick up the bag and put into the bowl.",
                      "The robot tries to pick up the bag and put it into the bowl.",
                      (0.48, 0.1), 0.0, bowl=BowlAt(0.5, -0.28, 0.16)),
            ProbeTask("cabinet close", "19179", Verb.CLOSE, "Close the drawer of the cabinet.",
                      "The robot tries to close the drawer of the cabinet.",
                      (0.6, 0.0), np.pi / 6, "joint_0", 0.25),
            ProbeTask("suitcase close", "103755", Verb.CLOSE, "Close the suitcase lid.",
                      "The robot tries to close the suitcase.",
                      (0.5, 0.0), 0.0, "joint_1", 0.4),
            ProbeTask("trashcan close", "102181", Verb.CLOSE, "Close the trashcan lid.",
                      "The robot tries to close the trashcan lid.",
                      (0.5, 0.0), 0.0, "joint_1", 0.4),
        )
    }
)  # fmt: skip
"""By the names that the paper's tables have."""
