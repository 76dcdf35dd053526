"""How many assets this machine's memory lets be at work at once."""

import os
from contextlib import suppress
from pathlib import Path

from schemas.settings import Settings

CGROUP_LIMITS = (Path("/sys/fs/cgroup/memory.max"), Path("/sys/fs/cgroup/memory/memory.limit_in_bytes"))
"""Where a container's memory limit is, by version of the kernel's interface."""


def machine_memory_mb() -> int:
    """Memory of this machine, or of the container that this process is in, MB."""
    found = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    for file in CGROUP_LIMITS:
        with suppress(OSError, ValueError):
            found = min(found, int(file.read_text(encoding="ascii")))
    return found // 2**20


def bounded_by_memory(settings: Settings, memory_mb: int | None = None) -> tuple[Settings, str | None]:
    """The settings with no more workers than fit into memory, and a sentence where that is fewer than asked for.
    Workers of an existing cluster are not counted: they have machines of their own."""
    run = settings.run
    if run.scheduler is not None:
        return settings, None
    memory_mb = machine_memory_mb() if memory_mb is None else memory_mb
    most = max(1, (memory_mb - run.own_memory_mb) // run.worker_memory_mb)
    if run.workers <= most:
        return settings, None
    sentence = (
        f"{most} assets are refined at once, not {run.workers}: each takes up to {run.worker_memory_mb} MB, the run "
        f"itself {run.own_memory_mb} MB, and this machine has {memory_mb} MB (run.worker_memory_mb and "
        "run.own_memory_mb set the former two)"
    )
    return settings.model_copy(update={"run": run.model_copy(update={"workers": most})}), sentence
