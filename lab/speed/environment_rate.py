"""How many actions a second of one core an environment of an object takes: FOLDER ... [--door PYTHON], beside
robosuite's own door task, asked in turn with ours so that both have the same machine."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Literal

from pydantic import Field
from pydantic_settings import CliPositionalArg

from asset2sim.catalog.text import markdown_table
from asset2sim.gym.environment import ObjectEnv
from asset2sim.runs.command_line import Options, parse
from asset2sim.runs.option_types import Listed
from lab.speed import robosuite_door
from schemas.errors import DONE, UsageError, exit_code_of
from schemas.learning_settings import LearningSettings

PROGRAM = "python -m lab.speed.environment_rate"
WARM = 20
"""Actions that are not counted."""


@dataclass(frozen=True)
class Rate:
    """How fast an environment was: ``rate`` actions a second of one core, of ``action_s`` simulated seconds each in
    time steps of ``timestep_s``."""

    name: str
    rate: float
    action_s: float
    timestep_s: float

    @property
    def simulated(self) -> float:
        """Simulated seconds a second of one core: what environments of different clocks are compared by."""
        return self.rate * self.action_s


class EnvironmentRateOptions(Options):
    """How many actions a second of one core the environments of refined objects take."""

    folders: CliPositionalArg[Listed[tuple[Path, ...]]] = Field(description="folders of refined objects, OUT/assets/ID")
    door: Path | None = Field(None, description="a Python that has robosuite, whose door task is measured in turn")
    gripper: Literal["panda", "robotiq"] = Field(
        "panda", description="gripper of ours: panda, or robotiq, which reads robosuite's model"
    )
    seconds: float = Field(5.0, gt=0.0, description="processor time of one measurement")
    rounds: int = Field(3, ge=1, description="measurements of each; the median counts")


def object_rate(folder: Path, seconds: float, gripper: Literal["panda", "robotiq"] = "panda") -> Rate:
    """Random actions with one object for so many seconds of processor time, episodes begun anew as they end. Raises as
    ``ObjectEnv`` does."""
    env = ObjectEnv(folder, settings=LearningSettings(gripper=gripper))
    env.action_space.seed(0)
    env.reset(seed=0)
    for _ in range(WARM):
        env.step(env.action_space.sample())
    began, actions = time.process_time(), 0
    while time.process_time() - began < seconds:
        _, _, lost, ended, _ = env.step(env.action_space.sample())
        actions += 1
        if lost or ended:
            env.reset()
    took = time.process_time() - began
    return Rate(env.subject.task.name, actions / took, env.dt_s, env.settings.timestep_s)


def door_rate(python: Path, seconds: float) -> Rate:
    """As ``object_rate``, of robosuite's door in another interpreter. Raises UsageError where that has no robosuite."""
    done = subprocess.run(
        [str(python), str(robosuite_door.__file__), str(seconds)],
        capture_output=True, text=True, check=False, env=os.environ | {"OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode or not lines:
        said = (done.stderr.strip().splitlines() or ["it said nothing"])[-1]
        raise UsageError(f"{python} cannot run robosuite's door: {said}; pip install robosuite==1.5.2 mujoco==3.3.7")
    return Rate("robosuite's door", **json.loads(lines[-1]))


def rates(options: EnvironmentRateOptions) -> list[Rate]:
    """The median of each environment's measurements, taken in turn."""
    found: dict[str, list[Rate]] = {}
    for _ in range(options.rounds):
        for folder in options.folders:
            found.setdefault(str(folder), []).append(object_rate(folder, options.seconds, options.gripper))
        if options.door is not None:
            found.setdefault("door", []).append(door_rate(options.door, options.seconds))
    return [sorted(some, key=lambda one: one.rate)[len(some) // 2] for some in found.values()]


def described(found: Sequence[Rate]) -> str:
    """A Markdown table of rates; the last line is the median of ours over the door, where that was measured."""
    rows = [
        [one.name, f"{one.rate:.0f}", f"{1e3 * one.action_s:.0f} ms", f"{1e3 * one.timestep_s:.0f} ms",
         f"{one.simulated:.1f}"]
        for one in found
    ]  # fmt: skip
    table = markdown_table(["environment", "actions/s", "an action", "a time step", "simulated s/s"], rows, range(1, 5))
    doors = [one.simulated for one in found if one.name == "robosuite's door"]
    ours = [one.simulated for one in found if one.name != "robosuite's door"]
    if doors and ours:
        table += f"\nours over the door, simulated s/s: {median(ours) / doors[0]:.1f} (median)\n"
    return table


def measure_rates(options: EnvironmentRateOptions) -> int:
    """Measure and print. Returns the exit code."""
    if not options.folders:
        raise UsageError("name folders of refined objects, OUT/assets/ID")
    sys.stdout.write(described(rates(options)) + "\n")
    return DONE


def main(words: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    return exit_code_of("environment_rate", lambda: measure_rates(parse(EnvironmentRateOptions, words, PROGRAM)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
