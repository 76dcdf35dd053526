"""Requests of ``asset2sim refine`` and ``asset2sim nightly``, and what this machine lets a run have at once."""

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from pydantic import Field, InstanceOf

from asset2sim.runs.command_line import Options
from asset2sim.runs.options import NightlyOptions, RefineOptions, parse
from schemas.asset import FoundAssets
from schemas.base import Frozen
from schemas.csv_rows import rows_beside
from schemas.errors import UsageError
from schemas.location import Location
from schemas.settings import Settings
from schemas.vocabulary import Method, Redo

SETS = {row["option"]: row["setting"] for row in rows_beside(__file__, "options.csv")}
"""Option → the setting that it states."""


class RefineRequest(Frozen):
    """A dataset, what to take of it, where the result goes, and the settings.

    ``settings`` is what ``settings_file`` and the options come to now; ``stated`` is what the options state, nested as
    in a file: a nightly reads the file again each night. ``strict`` makes a run that holds a failed asset fail; ``now``
    asks for one night at once instead of the schedule, ``cron`` is one to use instead of ``catalog.yaml``'s, and
    ``dry_run`` asks what a run would do. ``secrets`` names where those of the settings are, where they are redacted.
    """

    data: Location
    out: Location
    subset: str | None = None
    asset_ids: tuple[str, ...] = ()
    limit: int | None = None
    settings: Settings = Settings()
    settings_file: Path | None = None
    stated: dict[str, Any] = Field(default_factory=dict)
    strict: bool = False
    now: bool = False
    cron: str | None = None
    dry_run: bool = False
    secrets: str | None = None
    found: InstanceOf[FoundAssets] | None = Field(default=None, exclude=True)


def parse_request(words: Sequence[str]) -> RefineRequest:
    """The request that a command line of ``asset2sim refine`` or ``asset2sim nightly`` makes. Raises UsageError."""
    options = parse(words)
    if not isinstance(options, RefineOptions):
        raise UsageError(f"'{words[0]}' refines nothing; choose from: refine, nightly")
    return refine_request(options)


def refine_request(options: RefineOptions) -> RefineRequest:
    """The request that the options of ``asset2sim refine`` or ``asset2sim nightly`` make."""
    stated = stated_settings(options)
    return RefineRequest(
        data=options.data,
        out=options.out,
        subset=options.subset,
        asset_ids=options.assets,
        limit=options.limit,
        settings=settings_for_run(options.settings, stated),
        settings_file=options.settings and options.settings.resolve(),
        stated=stated,
        strict=options.strict,
        now=isinstance(options, NightlyOptions) and options.now,
        cron=options.cron if isinstance(options, NightlyOptions) else None,
        dry_run=options.dry_run,
    )


def stated_settings(options: Options) -> dict[str, Any]:
    """The settings that the options given on a command line state, nested as in a settings file."""
    found: dict[str, Any] = {}
    for name in SETS.keys() & options.model_fields_set:
        found = merged_mappings(found, _nested(SETS[name], getattr(options, name)))
    if isinstance(options, RefineOptions) and (options.force or options.retry_failed):
        found = merged_mappings(found, _nested("run.redo", Redo.ALL if options.force else Redo.FAILED))
    return found


def settings_of(options: Options) -> Settings:
    """A command's settings: of its options, else its settings file, else built in. UsageError for either."""
    return settings_for_run(getattr(options, "settings", None), stated_settings(options))


def settings_for_run(file: Path | None, stated: Mapping[str, Any], below: Mapping[str, Any] | None = None) -> Settings:
    """The settings of a run on this machine: as stated, else as in the file, else as ``below``, else built in, with a
    worker a core. Raises UsageError for a file that cannot be read or that states something else than settings, and for
    a method of a distribution that is not installed."""
    found = merged_mappings({"run": {"workers": usable_cores()}}, below or {})
    if file is not None:
        from asset2sim.runs.settings_file import read_settings

        found = merged_mappings(found, read_settings(file))
    settings = Settings.model_validate(merged_mappings(found, stated))
    if settings.method is not Method.ASSET2SIM:
        from asset2sim.baselines.declared_method import require_method  # late: methods take half a second to import

        require_method(settings.method)
    return settings


def merged_mappings(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Two nested mappings as one; where both state a field, ``above`` has it."""
    found = dict(below)
    for name, value in above.items():
        both = isinstance(value, Mapping) and isinstance(found.get(name), Mapping)
        found[name] = merged_mappings(found[name], value) if both else value
    return found


def usable_cores() -> int:
    """Processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _nested(path: str, value: object) -> dict[str, Any]:
    section, _, field = path.rpartition(".")
    return {section: {field: value}} if section else {field: value}


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
