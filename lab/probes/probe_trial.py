"""One trial of a policy: connect, run the episode, and a row of the table of probe trials, however it ends."""

import statistics
import time
from collections.abc import Callable

import mujoco

from asset2sim.load import LoadError
from lab.probes.answers import PolicyError, TrialEnding
from lab.probes.experts import NoWayError
from lab.probes.observation import Chunk, Observation, Policy
from lab.probes.policies import PolicySpec, opened
from lab.probes.serving import ServingError
from lab.runner import FAILED
from lab.schemas.probe_settings import ProbeSettings
from schemas.table import Row

SHARE = 0.8
"""Share of a trial's wall time that its policy may take in all: the trial then ends by itself and says so."""
Episode = Callable[[Callable[[Observation], Chunk]], Row]
"""An episode to be run with a policy; its row holds columns of the table of probe trials."""


class Timed:
    """A policy whose answers are timed. Raises PolicyError once they took too long in all."""

    def __init__(self, policy: Policy, most_s: float) -> None:
        self.policy, self.most_s = policy, most_s
        self.latencies: list[float] = []

    def __call__(self, seen: Observation) -> Chunk:
        """The policy's answer."""
        if sum(self.latencies) > self.most_s:
            raise PolicyError(TrialEnding.TIMED_OUT, f"{len(self.latencies)} answers took more than {self.most_s:g} s")
        began = time.monotonic()
        try:
            return self.policy(seen)
        finally:
            self.latencies.append(time.monotonic() - began)


def run_probe(episode: Episode, spec: PolicySpec, make: Callable[[], Policy], settings: ProbeSettings) -> Row:
    """The row of an episode with a policy, but for what the run knows. What the policy does wrong is an outcome, and no
    result of the object; that it cannot be put into the scene, or that a probe of ours finds no way, is one."""
    began = time.monotonic()
    timed: Timed | None = None
    try:
        with opened(spec, make, settings) as policy:
            timed = Timed(policy, SHARE * settings.trial_s)
            row = episode(timed)
    except PolicyError as error:
        row = {"outcome": error.ending.value, "reason": str(error), "success": None}
    except (LoadError, ValueError, NoWayError, ServingError, mujoco.FatalError) as error:
        row = {"outcome": FAILED, "reason": str(error).partition("\n")[0], "success": False}
    latencies = timed.latencies if timed is not None else []
    times: Row = {
        "latency_s": statistics.median(latencies) if latencies else None,
        "latency_max_s": max(latencies, default=None),
    }
    return row | times | {"asked": len(latencies), "seconds": time.monotonic() - began}
