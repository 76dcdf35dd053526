"""The commands for objects on this machine: check, describe, convert and refine, with no server and no catalog."""

import sys
from collections.abc import Callable, Sequence
from functools import partial
from json import dumps, loads
from pathlib import Path
from typing import Any

from rich import box
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from asset2sim.catalog.text import NOTHING, output
from asset2sim.checks.verdict import failures_of
from asset2sim.engines.registry import HOW_TO_INSTALL, installed
from asset2sim.engines.static_object import with_pybullet
from asset2sim.intake.dataset import load_dataset
from asset2sim.models.gateway.environment import quiet_environment
from asset2sim.runs.asking_attempt import refine_here
from asset2sim.runs.check_folders import check_as_json, check_as_sarif, check_folders, engine_verdict, remedy_of
from asset2sim.runs.option_groups import CheckOptions, ConvertOptions, DescribeOptions
from asset2sim.runs.request import RefineRequest
from flows import PIPELINE
from schemas.asset import AssetRecord
from schemas.errors import DONE, FAILED, UsageError, complain
from schemas.settings import Settings
from schemas.vocabulary import Severity, Stage, Status

CHECK_PIPELINE, CONVERT_PIPELINE = "tasks.check:check_asset", "tasks.check:convert_asset"
SAID_BESIDE = ("no_inertials", "changed_by_hand", "refined_state_unread", "refined_joint_unknown", "support_guessed")
"""Codes of findings of a check that the terminal shows beside the verdict, and the warnings on what the file states."""
MOST_SAID = 5
"""Things that the terminal says are wrong with one object, at most."""


def refine_listed(request: RefineRequest) -> int:
    """Refine a checked request's assets into OUT/assets and print a row for each. Returns the exit code."""
    assert request.found is not None, "the request has been checked"
    if request.out.is_url:
        raise UsageError("--out is a URL: runs write there; pip install 'asset2sim[pipeline]'")
    say_what_is_absent()
    records = refine_here(request.found.refs, request.out.folder, request.settings, PIPELINE)
    print_records(records, request.settings, reason_of)
    output().print(Text(f"assets: {request.out.folder / 'assets'}"))
    return FAILED if request.strict and failed_of(records) else DONE


def print_description(options: DescribeOptions, _: Settings) -> None:
    """Print what a refined object is. Raises UsageError for a folder of none."""
    from asset2sim.load import LoadError, describe

    try:
        sys.stdout.write(f"{describe(options.folder)}\n")
    except LoadError as error:
        raise UsageError(str(error)) from error


def convert_listed(options: ConvertOptions, settings: Settings) -> int:
    """Convert assets, unrefined, into ``out/assets`` and print a row for each. Returns the exit code."""
    from asset2sim.assets.exports import require_exports

    quiet_environment()
    require_exports(settings.exports)
    views = settings.views.model_copy(update={"write": False})
    out, chosen = options.out, settings.model_copy(update={"views": views})
    records = refine_here(load_dataset(options.data), out, chosen, CONVERT_PIPELINE)
    table = Table(box=box.SIMPLE_HEAD)
    for name in ("asset", "result", "findings"):
        table.add_column(name, overflow="fold")
    for record in records:
        ok = record.status is Status.OK
        said = [item.message for item in record.findings if item.severity is not Severity.INFO]
        result = str(out / "assets" / record.ref.asset_id) if ok else record.failure_mode.value
        table.add_row(Text(record.ref.asset_id), Text(result), Text("; ".join(said if ok else [record.reason])))
    output().print(table)
    return FAILED if failed_of(records) else DONE


def check_listed(options: CheckOptions, settings: Settings) -> int:
    """Check folders as they are, and print a row, or JSON, for each, and write them as SARIF to a file; refine those
    that fail into ``fix``. Returns the exit code: 1 where one fails, or with ``fix`` where one fails mended, too."""
    quiet_environment()
    say_what_is_absent()
    records, fix = check_folders(options.folders, settings, CHECK_PIPELINE), options.fix
    if options.sarif is not None:
        options.sarif.write_text(dumps(check_as_sarif(records, Path.cwd()), indent=1), encoding="utf-8")
    if options.json_:
        print_json([check_as_json(record, settings) for record in records])
    else:
        print_records(records, settings, partial(all_that_is_wrong, settings=settings))
    failed = failed_of(records)
    if fix is None or not failed:
        if failed and not options.json_:
            output().print(Text("--fix FOLDER refines what fails"))
        return FAILED if failed else DONE
    mended = refine_here([record.ref for record in failed], fix, settings, PIPELINE)
    if not options.json_:
        print_records(mended, settings, reason_of)
        output().print(Text(f"mended: {fix / 'assets'}"))
    return FAILED if failed_of(mended) else DONE


def failed_of(records: Sequence[AssetRecord]) -> list[AssetRecord]:
    """The records of assets that failed."""
    return [record for record in records if record.status is not Status.OK]


def print_json(told: Any) -> None:
    """Print values as JSON; what exploded has numbers that JSON does not, and they are null."""
    sys.stdout.write(f"{dumps(loads(dumps(told), parse_constant=lambda _: None), indent=1)}\n")


def print_records(records: Sequence[AssetRecord], settings: Settings, say: Callable[[AssetRecord], list[str]]) -> None:
    """Print each asset's verdict and that of each engine; below, what there is to say of an asset, a line each."""
    engines = list(dict.fromkeys(report.engine for record in records for report in record.reports))
    table = Table(box=box.SIMPLE_HEAD)
    for name in ("asset", "verdict", *engines):
        table.add_column(name, overflow="fold", no_wrap=name != "asset")
    for record in records:
        seen = {report.engine: engine_verdict(record, report, settings) for report in record.reports}
        ok = record.status is Status.OK
        table.add_row(
            Text(record.ref.asset_id),
            Text("ok", style="green") if ok else Text(record.failure_mode, style="bold red"),
            *(Text(seen.get(name, NOTHING)) for name in engines),
        )
    output().print(table)
    for record in records:
        if lines := say(record):
            output().print(Text(record.ref.asset_id, style="bold"))
            output().print(*(Padding(Text(f"- {line}"), (0, 0, 0, 2)) for line in lines), sep="")
    output().print(Text(f"{len(records) - len(failed_of(records))} of {len(records)} ok"))


def reason_of(record: AssetRecord) -> list[str]:
    """Why a refined object failed, and what would mend it; nothing of one that is ok."""
    failed = record.status is not Status.OK
    return [record.reason, f"remedy: {remedy_of(record.failure_mode)}"] if failed else []


def all_that_is_wrong(record: AssetRecord, settings: Settings) -> list[str]:
    """All that is wrong with an object as it is, once a kind: what its file lacks or misstates, what it failed in any
    engine, and what would mend the first failure."""
    stated: dict[str, str] = {}
    for item in record.findings:
        if item.code in SAID_BESIDE or (item.severity is Severity.WARNING and item.stage is not Stage.MEASURE):
            stated.setdefault(item.code, item.message)
    first, *remedy = reason_of(record) or [""]
    failed = {(record.failure_mode, ""): first}
    for report in record.reports:
        assert record.overlay is not None, "what was measured has an overlay"
        for failure in failures_of(report, record.overlay, settings.thresholds):
            failed.setdefault((failure.mode, failure.subject), failure.reason)
    said = list(dict.fromkeys(filter(None, (*stated.values(), *failed.values()))))
    more = len(said) - MOST_SAID
    return [*said[:MOST_SAID], *([f"and {more} more, which --json has"] if more > 0 else []), *remedy]


def say_what_is_absent() -> None:
    """Say on standard error, once a command, that MuJoCo does the part of PyBullet where that is not installed."""
    if not with_pybullet():
        there = ", ".join(installed()) or "none"
        complain(f"PyBullet is not installed; engines: {there} ({HOW_TO_INSTALL})")
