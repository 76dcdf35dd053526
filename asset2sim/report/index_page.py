"""Contents of the report's index: a run beside the one before it, failures, distributions, and all objects."""

import json
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from asset2sim.catalog.read import FrameRow
from asset2sim.catalog.text import NOTHING, duration, percent, significant
from asset2sim.report.charts import histogram, line
from asset2sim.report.snapshot import Snapshot
from schemas.errors import shortened
from schemas.model_names import described
from schemas.table import ASSET_KEY
from schemas.vocabulary import FailureMode

MAX_TEXT = 160
"""Characters of a prompt or a reason in the list, where they are searched: the object's page has all."""
DAY_S = 86_400.0


class HeadlineFigure(NamedTuple):
    """One headline figure: of this run, of the run before, and the change in words."""

    name: str
    now: str
    then: str = NOTHING
    change: str = ""
    better: bool | None = None


class Chart(NamedTuple):
    """A chart with its heading and a sentence on what it shows."""

    title: str
    svg: str
    note: str


class FailureGroup(NamedTuple):
    """Failures counted by something: a line for each of its values, (value, objects, share that passes, failures of
    each mode). ``by`` is its name in the list's filter, "" where it has none."""

    title: str
    by: str
    lines: tuple[tuple[str, int, str, tuple[int, ...]], ...]
    rest: int = 0
    """Values without a failure, which have no line."""


def index_page(found: Snapshot, pictures: Collection[str]) -> dict[str, Any]:
    """The template's values for the index; ``pictures`` are the assets with a thumbnail."""
    assets = found.assets
    efforts = opening_efforts(found.tables["interactions"])
    return {
        "run": found.run,
        "before": found.before,
        "model": described(str(found.run["model"])),
        "figures": figures(found),
        "modes": (modes := failure_modes(assets, found.runs)),
        "groups": failure_groups(assets, found.runs, modes),
        "history": history(found.runs),
        "charts": distributions(found, assets, efforts),
        "data": columns(found, assets, efforts, pictures),
        "several": len({method_of(row) for row in assets}) > 1,
        "total": len(assets),
    }


def method_of(row: FrameRow) -> str:
    """Method and model of a row, as people read them."""
    return f"{row['method']}, {described(str(row['model']))}"


def figures(found: Snapshot) -> list[HeadlineFigure]:
    """The headline figures of the latest run, beside those of the run before it."""
    now, then = found.run, found.before
    changes = Counter(_changes(found).values())
    figures = [_share("pass", now, then, "ok", better=1), _share("fail", now, then, "failed", better=-1)]
    if then is not None:
        figures += [HeadlineFigure("new failures", str(changes["new"]), better=changes["new"] == 0 or None)]
        figures += [HeadlineFigure("mended", str(changes["mended"]), better=True if changes["mended"] else None)]
    figures += [
        _count("refined", now, then, lambda run: run["assets"] - (run["unchanged"] or 0)),
        _count("model calls", now, then, lambda run: run["queries"]),
        _count("tokens", now, then, lambda run: run["prompt_tokens"] + run["completion_tokens"]),
        _count("cost, USD", now, then, lambda run: run["cost_usd"], lambda value: f"{value:.2f}"),
        _count("wall time", now, then, lambda run: run["seconds"], duration),
        _count("work", now, then, lambda run: run["asset_seconds"], duration),
    ]
    return figures


def _share(name: str, now: FrameRow, then: FrameRow | None, column: str, better: int) -> HeadlineFigure:
    shown = f"{now[column]} of {now['assets']}"
    if then is None:
        return HeadlineFigure(name, shown, change=percent(now[column], now["assets"]) if now["assets"] else "")
    step = now[column] - then[column]
    change, improved = (f"{step:+d}", step * better > 0) if step else ("same", None)
    return HeadlineFigure(name, shown, f"{then[column]} of {then['assets']}", change, improved)


def _count(
    name: str,
    now: FrameRow,
    then: FrameRow | None,
    of: Callable[[FrameRow], float],
    shown: Callable[[float], str] = lambda v: f"{v:,}",
) -> HeadlineFigure:
    return HeadlineFigure(name, shown(of(now)), NOTHING if then is None else shown(of(then)))


def _changes(found: Snapshot) -> dict[tuple[str, ...], str]:
    """Assets of the latest run that fail and did not before (``new``), or the other way round (``mended``)."""
    if found.before is None:
        return {}
    now, then = (found.modes.get(run["run_id"], {}) for run in (found.run, found.before))
    ok = FailureMode.NONE.value
    changed = {key: (then.get(key, ok), mode) for key, mode in now.items() if (then.get(key, ok) == ok) != (mode == ok)}
    return {key: "new" if was == ok else "mended" for key, (was, _) in changed.items()}


def failure_modes(assets: Sequence[FrameRow], runs: Sequence[FrameRow]) -> tuple[str, ...]:
    """The failure modes of the objects as they are, the most frequent first, and then those of earlier months."""
    every = Counter(row["failure_mode"] for row in assets)
    earlier = Counter[str]()
    for run in _months(runs).values():
        earlier.update(json.loads(run["failure_modes_json"]))
    named = dict.fromkeys(mode for counted in (every, earlier) for mode, _ in counted.most_common())
    return tuple(mode for mode in named if mode != FailureMode.NONE)


def failure_groups(assets: Sequence[FrameRow], runs: Sequence[FrameRow], modes: Sequence[str]) -> list[FailureGroup]:
    """Failures by category and by method, of all objects as they are, and by month, of each month's last run."""
    months = {month: Counter[str](json.loads(run["failure_modes_json"])) for month, run in _months(runs).items()}
    newest = dict(sorted(months.items(), reverse=True))
    return [
        _group("by category", "category", _counted(assets, lambda row: row["category"] or "none stated"), modes),
        _group("by method and model", "method", _counted(assets, method_of), modes, every=True),
        FailureGroup("by month, at its last run", "", tuple(_line(*item, modes) for item in newest.items())),
    ]


def _months(runs: Sequence[FrameRow]) -> dict[str, FrameRow]:
    return {f"{run['started_at']:%Y-%m}": run for run in runs}


def _counted(assets: Sequence[FrameRow], of: Callable[[FrameRow], str]) -> dict[str, Counter[str]]:
    counted: dict[str, Counter[str]] = defaultdict(Counter)
    for row in assets:
        counted[of(row)][row["failure_mode"]] += 1
    return counted


def _group(
    title: str, by: str, counted: Mapping[str, Counter[str]], modes: Sequence[str], every: bool = False
) -> FailureGroup:
    """A group with the values that have failures, or ``every`` value, most failures first."""
    failures = {name: of_it.total() - of_it[FailureMode.NONE.value] for name, of_it in counted.items()}
    shown = sorted((name for name in counted if every or failures[name]), key=lambda name: (-failures[name], name))
    lines = tuple(_line(name, counted[name], modes) for name in shown)
    return FailureGroup(title, by, lines, len(counted) - len(shown))


def _line(name: str, counted: Counter[str], modes: Sequence[str]) -> tuple[str, int, str, tuple[int, ...]]:
    total = counted.total()
    share = percent(counted[FailureMode.NONE.value], total) if total else NOTHING
    return name, total, share, tuple(counted[mode] for mode in modes)


def history(runs: Sequence[FrameRow]) -> Chart | None:
    """Share of objects that pass, run by run; None for a first run."""
    shown = [run for run in runs if run["assets"]]
    if len(shown) < 2:
        return None
    points = [(run["started_at"].timestamp() / DAY_S, 100.0 * run["ok"] / run["assets"]) for run in shown]
    told = [f"{run['started_at']:%Y-%m-%d %H:%M}: {run['ok']} of {run['assets']} pass" for run in shown]
    lowest = min(share for _, share in points)
    same_day = points[-1][0] - points[0][0] < 2.0
    form = "%H:%M" if same_day else "%m-%d" if points[-1][0] - points[0][0] < 330.0 else "%Y-%m"
    svg = line(
        points, told, "share of objects that pass, by run", lambda day: f"{pd.Timestamp(day * DAY_S, unit='s'):{form}}",
        lambda value: f"{significant(value)} %", (min(lowest, 99.0), 100.0),
    )  # fmt: skip
    return Chart("History", svg, f"share of objects that pass, over {len(shown)} runs of the same selection")


def distributions(found: Snapshot, assets: Sequence[FrameRow], efforts: Mapping[tuple[str, ...], float]) -> list[Chart]:
    """Histograms of what was given and measured, without those that have nothing to show."""
    joints = found.tables["joints"]
    sliders = joints["position_unit"] == "m"
    charts = (
        ("Mass", "kg", [row["mass_kg"] for row in assets], "object", "of whole objects"),
        ("Size", "m", [longest_edge(row) for row in assets], "object", "longest edge of an object"),
        ("Damping of hinges", "N·m·s/rad", joints.loc[~sliders, "damping"].tolist(), "hinge", "of every hinge"),
        ("Damping of sliders", "N·s/m", joints.loc[sliders, "damping"].tolist(), "slider", "drawers, keys, buttons"),
        ("Opening effort", "N", list(efforts.values()), "object", "the hardest joint of an object, at its part's edge"),
        ("Time", "s", [row["seconds_total"] for row in assets], "object", "to refine an object"),
        ("Cost", "USD", [row["cost_usd"] for row in assets], "object", "of an object's model calls"),
    )
    made = [
        Chart(title, histogram(values, unit, f"{title}, {unit}: how many {what}s have it", what), note)
        for title, unit, values, what, note in charts
    ]
    return [chart for chart in made if chart.svg]


def longest_edge(row: FrameRow) -> float | None:
    """The longest edge of an object's box, m."""
    sizes = [row[f"size_{axis}_m"] for axis in "xyz"]
    return None if None in sizes else max(sizes)


def opening_efforts(interactions: pd.DataFrame) -> dict[tuple[str, ...], float]:
    """(asset, method, model) → the force that its hardest joint takes to open at its part's edge, N."""
    opening = (interactions["test"] == "effort") & (interactions["way"] == "opening")
    grouped = interactions[opening].groupby(list(ASSET_KEY))["value"].max()
    found: dict[Any, float] = grouped.to_dict()
    return {key: value for key, value in found.items() if np.isfinite(value)}


def columns(
    found: Snapshot, assets: Sequence[FrameRow], efforts: Mapping[tuple[str, ...], float], pictures: Collection[str]
) -> dict[str, Any]:
    """The list of objects as columns, for the page's script: texts that recur are numbers into ``words``."""
    changes = _changes(found)
    keys = [tuple(row[name] for name in ASSET_KEY) for row in assets]
    words: dict[str, list[str]] = {}

    def coded(name: str, values: Sequence[str]) -> list[int]:
        words[name] = sorted(set(values))
        numbers = {value: number for number, value in enumerate(words[name])}
        return [numbers[value] for value in values]

    return {
        "id": [row["asset_id"] for row in assets],
        "category": coded("category", [row["category"] or "none stated" for row in assets]),
        "mode": coded("mode", [row["failure_mode"] for row in assets]),
        "support": coded("support", [row["support"] or "not known" for row in assets]),
        "method": coded("method", [method_of(row) for row in assets]),
        "change": [{"new": 1, "mended": 2}.get(changes.get(key, ""), 0) for key in keys],
        "size": [_short(longest_edge(row)) for row in assets],
        "mass": [_short(row["mass_kg"]) for row in assets],
        "effort": [_short(efforts.get(key)) for key in keys],
        "phi": [_short(row["penetration_mm"]) for row in assets],
        "seconds": [_short(row["seconds_total"]) for row in assets],
        "cost": [_short(row["cost_usd"]) for row in assets],
        "prompt": [shortened(row["prompt"] or "", MAX_TEXT) for row in assets],
        "reason": ["" if row["status"] == "ok" else shortened(row["reason"], MAX_TEXT) for row in assets],
        "picture": [int(row["asset_id"] in pictures) for row in assets],
        "words": words,
    }


def _short(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.3g}")
