"""Each asset runs in a process that can be killed: a crash, a hang or a lack of memory costs one result."""

from asset2sim.experiments.isolation.pipe_messages import Ending, Outcome
from asset2sim.experiments.isolation.supervise import accept_children, run_isolated, stop_children

__all__ = ["Ending", "Outcome", "accept_children", "run_isolated", "stop_children"]
