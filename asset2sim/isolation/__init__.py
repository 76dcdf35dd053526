"""One asset at a time in a process that can be killed: a crash, a hang or a hunger for memory costs one result."""

from asset2sim.isolation.outcome import Ending, Outcome
from asset2sim.isolation.run import run_isolated
from asset2sim.isolation.stopping import accept_children, stop_children

__all__ = ["Ending", "Outcome", "accept_children", "run_isolated", "stop_children"]
