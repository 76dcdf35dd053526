"""Joints of a USD stage as its bodies stand on it: where they start, and which of two readings of their frames fits."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from asset2sim.intake.formats.usd_joints import DEGREE, Step, UsdJoint
from asset2sim.intake.formats.usd_stage import UsdStage
from asset2sim.physics.arrays import Array

if TYPE_CHECKING:
    from pxr import Usd

MEET_M = 1e-3
"""Distance between the two frames of a joint on the stage from which they do not meet."""
LEAST_START = 1e-4
"""Position of a joint on the stage, rad or m, below which it is rounding."""


def as_it_stands(stage: UsdStage, joint: UsdJoint, bodies: Mapping[str, "Usd.Prim"]) -> UsdJoint:
    """The joint, of one degree of freedom without a stated start with that at which its bodies stand on the stage, as
    one has it that was saved with its drawer open. Its frames are those without scale where its bodies stand as these
    alone hold them; where they do not stand as it holds them at all a note says so."""
    if len(joint.steps) > 1 or {*joint.bodies} - {*bodies, ""}:
        return joint
    step, places = joint.steps[0], [stage.rigid(bodies[path]) if path else np.eye(4) for path in joint.bodies]
    start, shift, turn = out_of_place(step, places, joint.frames)
    off = (shift > MEET_M or turn > DEGREE) and bool(joint.bodies[0] or step.kind != "fixed")
    if off or beyond_its_ends(step, start):
        plain, apart, turned = out_of_place(step, places, joint.unscaled)
        if apart <= MEET_M and turned <= DEGREE and not beyond_its_ends(step, plain):
            said = "as its bodies stand, the positions of its frames are not in the scale of what it names"
            stage.notes.append(f"joint {joint.path}: {said}")
            start, joint = plain, replace(joint, frames=joint.unscaled)
        elif off:
            far = f"{shift:.3g} m and {turn / DEGREE:.3g} degrees"
            stage.notes.append(f"the bodies of joint {joint.path} stand {far} off its frames, and are put there")
    if "start" in step.dynamics or abs(start) < LEAST_START:
        return joint
    return replace(joint, steps=(replace(step, dynamics=step.dynamics | {"start": start}),))


def out_of_place(step: Step, places: Sequence[Array], frames: tuple[Array, Array]) -> tuple[float, float, float]:
    """The position (rad or m) at which two bodies at these (4, 4) places stand, and by how much, m and rad, they are
    elsewhere than any position of their joint has them."""
    apart = np.linalg.inv(places[0] @ frames[0]) @ places[1] @ frames[1]
    shift, turn = apart[:3, 3], Rotation.from_matrix(apart[:3, :3]).as_rotvec()
    moved = {"fixed": np.zeros(3), "prismatic": shift}.get(step.kind, turn)
    start = float(moved @ step.axis)
    moved -= start * step.axis
    return start, float(np.linalg.norm(shift)), float(np.linalg.norm(turn))


def beyond_its_ends(step: Step, start: float) -> bool:
    """Whether a slide stands where its limits do not let it."""
    lower, upper = step.limit.get("lower", -math.inf), step.limit.get("upper", math.inf)
    return step.kind == "prismatic" and not lower - MEET_M <= start <= upper + MEET_M
