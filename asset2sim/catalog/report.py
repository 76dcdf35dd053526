"""The report of a run in Markdown: a pure function of its records and the catalog before it. Its length is bounded:
every list names its first few and counts the rest, so that 10,000 assets make a page as well."""

import re
import shlex
from collections import Counter
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from functools import partial

from asset2sim.catalog.changes import AssetChange, Changes, Previous
from asset2sim.catalog.report_file import page_path
from asset2sim.catalog.rows import run_cost
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.text import NOTHING, markdown_table, number
from schemas.asset import Unchanged
from schemas.errors import shortened
from schemas.model_names import described
from schemas.summary import AssetSummary
from schemas.vocabulary import RETRIED_MODES, FailureMode, Stage, Status

MAX_LISTED = 50
"""Assets that one list names; the tables hold all."""
MAX_EXAMPLES = 5
MAX_SLOWEST = 10
MAX_REASON = 240
"""Characters of a reason in a table's cell."""

_SPECIAL = re.compile(r"([\\`*\[\]<>|~]|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9]))")


def report_markdown(
    run: RunRow,
    records: Sequence[AssetSummary],
    previous: Previous,
    changes: Changes,
    problems: Sequence[str] = (),
    unchanged: Sequence[Unchanged] = (),
    out: str = "OUT",
    pages: str | None = None,
) -> str:
    """Report in Markdown: counts beside the last run's, new failures, mended assets, failure modes, slowest assets.
    ``changes`` is ``find_changes(records, previous)``; ``problems`` lists other errors, first the reason why the run
    stopped; ``unchanged`` are the assets not refined again, and ``out`` is the folder to name in commands. ``pages`` is
    where the report for people is, relative to this one: assets are links to their pages then."""
    stopped = "" if run.outcome == "finished" else f"{run.outcome.capitalize()}: "
    broken = partial(_broken, pages)
    parts = [
        f"# {stopped}{headline(records, changes, unchanged)}",
        _about(run),
        *(f"> **{escape(problem)}**" for problem in problems),
        _counts(run, records, previous, changes, unchanged),
        _list("New failures", changes.new_failures, ("asset", "category", "failure mode", "was", "why"), broken),
        _list("Mended", changes.mended, ("asset", "category", "was"), partial(_mended, pages)),
        _modes(records, unchanged, pages),
        _list("Failing as before", changes.still_failing, ("asset", "category", "failure mode", "was", "why"), broken),
        _slowest(records, pages),
        _standing(len(records) + len(unchanged), changes),
        _next(run, records, changes, unchanged, out),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def headline(records: Sequence[AssetSummary], changes: Changes, unchanged: Sequence[Unchanged] = ()) -> str:
    """One line: assets that pass (unchanged ones included), new failures, mended, gone and unchanged assets."""
    every: list[AssetSummary | Unchanged] = [*records, *unchanged]
    parts = [f"{_passing(every)} of {len(every)} ok"] if every else ["no assets"]
    new = len(changes.new_failures)
    parts.append(f"{new} new failure{'' if new == 1 else 's'}")
    others = (("mended", len(changes.mended)), ("gone", len(changes.gone)), ("unchanged", len(unchanged)))
    return ", ".join([*parts, *(f"{count} {what}" for what, count in others if count)])


def _passing(items: Sequence[AssetSummary | Unchanged]) -> int:
    return sum(item.status is Status.OK for item in items)


def escape(text: str) -> str:
    """Text as one line, with Markdown's special characters escaped."""
    return _SPECIAL.sub(r"\\\1", " ".join(text.split()))


def _about(run: RunRow) -> str:
    commit = f"commit `{run.git_commit[:12]}`{' with changes' if run.git_dirty else ''}" if run.git_commit else None
    parts = [
        f"Run `{run.run_id}`, {run.outcome}",
        f"from {_moment(run.started_at)} to {_moment(run.finished_at)}, {_length(run)}",
        f"dataset {escape(run.dataset)}" + (f", subset {escape(run.subset)}" if run.subset else ""),
        f"method {escape(run.settings.method.value)}, model {escape(described(run.settings.model.model))}",
    ]
    return " · ".join([*parts, *([commit] if commit else [])])


def _counts(
    run: RunRow, records: Sequence[AssetSummary], previous: Previous, changes: Changes, unchanged: Sequence[Unchanged]
) -> str:
    every: list[AssetSummary | Unchanged] = [*records, *unchanged]
    ok, cost, before = _passing(every), run_cost(records), previous.run
    cached = sum(record.cached_calls for record in records)
    now = {
        "assets": f"{len(every)}",
        "ok": _share(ok, len(every)),
        "failed": _share(len(every) - ok, len(every)),
        "refined in this run": f"{len(records)}",
        "gone from the dataset": f"{len(changes.gone)}",
        "new failures": f"{len(changes.new_failures)}",
        "mended": f"{len(changes.mended)}",
        "model calls": f"{cost['queries']}, and {cached} from the cache",
        "calls an asset refined": _ratio(cost["queries"], len(records)),
        "tokens": f"{cost['prompt_tokens'] + cost['completion_tokens']}",
        "cost, USD": f"{cost['cost_usd']:.2f}",
        "time, s": f"{(run.finished_at - run.started_at).total_seconds():.0f}",
        "work on assets, s": f"{sum(record.total_seconds for record in records):.0f}",
    }
    then = {}
    if before is not None:
        then = {
            "assets": f"{before.assets}",
            "ok": _share(before.ok, before.assets),
            "failed": _share(before.assets - before.ok, before.assets),
            "refined in this run": f"{before.refined}",
            "model calls": f"{before.queries}",
            "calls an asset refined": _ratio(before.queries, before.refined),
            "tokens": f"{before.tokens}",
            "cost, USD": f"{before.cost_usd:.2f}",
            "time, s": f"{before.seconds:.0f}",
            "work on assets, s": f"{before.asset_seconds:.0f}",
        }
    last = f"run before, {_moment(before.started_at)}" if before else "run before"
    rows = [(name, figure, then.get(name, NOTHING)) for name, figure in now.items()]
    return markdown_table(("", "this run", last), rows, right=(1, 2))


def _list(
    title: str, items: Sequence[AssetChange], headings: Sequence[str], cells: Callable[[AssetChange], tuple[str, ...]]
) -> str:
    if not items:
        return ""
    more = f"\n\n… and {len(items) - MAX_LISTED} more." if len(items) > MAX_LISTED else ""
    return f"## {title}: {len(items)}\n\n{markdown_table(headings, [cells(item) for item in items[:MAX_LISTED]])}{more}"


def _broken(pages: str | None, item: AssetChange) -> tuple[str, ...]:
    asset, category, was = _mended(pages, item)
    mode, reason = item.record.failure_mode.value, shortened(item.record.reason, MAX_REASON)
    return asset, category, f"`{mode}`", was, escape(reason)


def _mended(pages: str | None, item: AssetChange) -> tuple[str, str, str]:
    return _name(item.record.ref.asset_id, pages), escape(item.record.category), _was(item.was)


def _name(asset_id: str, pages: str | None) -> str:
    """An asset's name in the report; a link to its page where there are ``pages``."""
    return escape(asset_id) if pages is None else f"[{escape(asset_id)}]({pages}/{page_path(asset_id)})"


def _modes(records: Sequence[AssetSummary], unchanged: Sequence[Unchanged], pages: str | None) -> str:
    """Table of failure modes, the most frequent first: assets, unchanged ones among them, error findings of the
    refined ones, and examples."""
    failed = [record for record in records if record.status is Status.FAILED]
    left = [item for item in unchanged if item.status is Status.FAILED]
    if not failed and not left:
        return ""
    rows = []
    modes = Counter([*(record.failure_mode for record in failed), *(item.failure_mode for item in left)])
    for mode, count in modes.most_common():
        mine = [record for record in failed if record.failure_mode is mode]
        others = [item.asset_id for item in left if item.failure_mode is mode]
        codes = Counter(code for record in mine for code in record.error_codes)
        causes = ", ".join(f"{escape(code)} ×{times}" for code, times in codes.most_common(MAX_EXAMPLES))
        names = [*(record.ref.asset_id for record in mine), *others]
        share = f"{100.0 * count / (len(records) + len(unchanged)):.1f} %"
        examples = ", ".join(_name(name, pages) for name in names[:MAX_EXAMPLES]) + (
            ", …" if count > MAX_EXAMPLES else ""
        )
        rows.append((f"`{mode.value}`", f"{count}", share, f"{len(others)}", causes or NOTHING, examples))
    headings = ("failure mode", "assets", "share", "unchanged", "causes", "for example")
    return f"## Failure modes\n\n{markdown_table(headings, rows, right=(1, 2, 3))}"


def _slowest(records: Sequence[AssetSummary], pages: str | None) -> str:
    timed = sorted(records, key=lambda record: record.total_seconds, reverse=True)[:MAX_SLOWEST]
    if not timed:
        return ""
    rows = [
        (_name(r.ref.asset_id, pages), escape(r.category), f"{r.total_seconds:.1f}", _longest_stage(r), f"{r.queries}")
        for r in timed
    ]
    table = markdown_table(("asset", "category", "s", "most of it in", "calls"), rows, right=(2, 4))
    return f"## Slowest assets\n\n{table}"


def _longest_stage(record: AssetSummary) -> str:
    stages = [(record.seconds[stage.value], stage.value) for stage in Stage if stage.value in record.seconds]
    if not stages:
        return NOTHING
    seconds, name = max(stages)
    return f"{name}, {seconds:.1f} s"


def _standing(seen: int, changes: Changes) -> str:
    """Sentence on the whole catalog; empty where it holds no more assets than this run."""
    if changes.standing_assets <= seen:
        return ""
    others, share = changes.standing_assets - seen, 100.0 * changes.standing_ok / changes.standing_assets
    return (
        f"With the {others} others of this method and model in the catalog, {changes.standing_ok} of "
        f"{changes.standing_assets} assets are ok ({share:.1f} %)."
    )


def _next(
    run: RunRow, records: Sequence[AssetSummary], changes: Changes, unchanged: Sequence[Unchanged], out: str
) -> str:
    """What to do next, the most urgent first; empty where nothing failed and nothing is left to do."""
    place = shlex.quote(out)
    steps = []
    if run.outcome == "interrupted":
        steps.append("The run was stopped before its end; the next one goes on from there.")
    if changes.new_failures:
        steps.append(
            f"What is known of a failure: `asset2sim show ASSET --out {place}`; what broke since the last run: "
            f"`asset2sim failures --compare previous latest --out {place}`."
        )
    every: list[AssetSummary | Unchanged] = [*records, *unchanged]
    failed = [item for item in every if item.status is Status.FAILED]
    passing = sum(item.failure_mode in RETRIED_MODES for item in failed)
    if passing:
        modes = ", ".join(f"`{mode.value}`" for mode in RETRIED_MODES)
        steps.append(f"{_assets(passing)} what may pass ({modes}): the next run tries again by itself.")
    if len(failed) > passing:
        steps.append(
            f"{_assets(len(failed) - passing)} what is in the dataset: change files or prompt, and the next run "
            "takes it up by itself; until then it is left alone (`--retry-failed` asks again all the same)."
        )
    return "\n".join(["## What to do next", "", *(f"- {step}" for step in steps)]) if steps else ""


def _assets(count: int) -> str:
    return "1 asset fails by" if count == 1 else f"{count} assets fail by"


def _was(mode: str | None) -> str:
    if mode is None:
        return "not there"
    return "ok" if mode == FailureMode.NONE else f"`{mode}`"


def _share(count: int, total: int) -> str:
    return f"{count} ({100.0 * count / total:.1f} %)" if total else f"{count}"


def _ratio(count: float, total: int) -> str:
    return number(count / total, digits=3) if total else NOTHING


def _moment(time: datetime) -> str:
    return f"{time.astimezone(UTC):%Y-%m-%d %H:%M} UTC"


def _length(run: RunRow) -> str:
    minutes, seconds = divmod(round((run.finished_at - run.started_at).total_seconds()), 60)
    if minutes >= 60:
        return f"{minutes // 60} h {minutes % 60:02d} min"
    return f"{minutes} min" if minutes else f"{seconds} s"
