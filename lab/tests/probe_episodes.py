"""A stand-in for the DROID scene, which takes seconds: episodes of a few questions and no simulation, for tests of what
is around them. It is driven by the policy's answers alone; ``lab/tests/test_probes_scene.py`` has the scene itself."""

import os
import signal
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np

from lab.probes.cameras import open_gl
from lab.probes.observation import OPEN_LOOP, Chunk, Observation, Policy
from lab.probes.policies import PolicySpec
from lab.probes.tasks import ProbeTask
from lab.trials.trial import FILM
from schemas.errors import UsageError
from schemas.table import Row

QUESTIONS, EPSILON = 4, 0.05
CRASHES = "crashes"
"""An asset that takes its process along."""


def run_episode(
    folder: Path, task: ProbeTask, seed: int, policy: Callable[[Observation], Chunk], to: Path, drawn: bool
) -> Row:
    """The first joint is to go to 1 rad from where the seed puts it."""
    if folder.name == CRASHES:
        os.kill(os.getpid(), signal.SIGKILL)
    picture = np.full((90, 160, 3), seed % 256, dtype=np.uint8)
    joints = np.zeros(7)
    joints[0] = start = 0.01 * seed
    for _ in range(QUESTIONS):
        chunk = policy(Observation(picture, picture, picture, joints.copy(), 0.0, task.name))
        for action in chunk.actions[:OPEN_LOOP]:
            joints = joints + action[:7] / 15.0
    (to / FILM).write_bytes(b"film")
    distance = abs(joints[0] - 1.0)
    success = bool(distance <= EPSILON)
    return {
        "instruction": task.name, "start": start, "target": 1.0, "end": float(joints[0]), "distance": float(distance),
        "tolerance": EPSILON, "success": success, "outcome": "done" if success else "not done",
        "reason": "" if success else "it is not there", "steps": QUESTIONS * OPEN_LOOP,
    }  # fmt: skip


def make_probe(spec: PolicySpec, folder: Path, task: ProbeTask, seed: int) -> Policy:
    """Goes there; the noisy one goes elsewhere."""
    if folder.name == "unplanned":
        raise ValueError("there is no way to it")
    goal = 1.0 if spec.name == "scripted" else 0.5

    def act(seen: Observation) -> Chunk:
        actions = np.zeros((10, 8))
        actions[:, 0] = np.clip((goal - seen.joints[0]) * 15.0 / OPEN_LOOP, -2.0, 2.0)
        return Chunk(actions, "joint_velocity")

    return act


def gl_works() -> bool:
    """Whether pictures can be drawn here."""
    with suppress(UsageError):
        open_gl(16, 16).free()
        return True
    return False
