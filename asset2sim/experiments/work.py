"""One piece of work in a child process of its own, which may crash or hang."""

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from asset2sim.experiments.isolation import Outcome, run_isolated
from schemas.settings import RunSettings


@dataclass(frozen=True)
class Work:
    """A function, or its name ``module:function``, its arguments, and the most that calling it may take. ``services``
    and ``fresh``: see ``run_isolated``."""

    function: Callable[..., object] | str
    args: tuple[object, ...]
    time_limit_s: float
    memory_limit_mb: int = RunSettings().asset_memory_limit_mb
    services: Mapping[str, Callable[..., object]] = field(default_factory=dict)
    fresh: bool = False


def in_child(work: Work, owner: str = "", log_path: Path | None = None) -> Outcome:
    """How the work ended. What it prints goes to ``log_path``; without one it is dropped. ``stop_children(owner)`` ends
    it."""
    with tempfile.TemporaryDirectory(prefix="asset2sim-work-") as place:
        return run_isolated(
            work.function, work.args, time_limit_s=work.time_limit_s, memory_limit_mb=work.memory_limit_mb,
            services=work.services, log_path=log_path or Path(place, "work.log"), owner=owner, fresh=work.fresh,
        )  # fmt: skip
