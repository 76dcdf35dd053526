"""Output of ``asset2sim ratings``: figures per method, agreement, order, and where people and numbers disagree."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from rich.console import RenderableType
from rich.text import Text
from scipy.stats import pearsonr

from asset2sim.catalog.own_files import read_own_files
from asset2sim.catalog.read import read_table
from asset2sim.catalog.text import NOTHING, number_table, significant
from lab.judged.figures import (
    TASK,
    VARIANT,
    OrderEffect,
    joined,
    krippendorff_alpha,
    latest_scores,
    mean_by_place,
    order_effect,
    rater_matrix,
    rating_figures,
    video_figures,
)
from lab.judged.physical_scores import PHYSICAL_JUDGE
from lab.judged.published import SUCCESS_FILE, published_rates, published_ratings, published_videos
from lab.judged.show_fidelity import describe_fidelity, describe_probes, real_rates, span
from lab.judged.variant_folders import variant_folders
from lab.runner import latest_own
from lab.schemas.tables import PROBE_TRIALS, RATING_KEYS, RATINGS, VIDEO_SCORES
from lab.trials.figures import variant_names
from schemas.errors import UsageError
from schemas.vocabulary import Status

MIDDLE = 5.0
"""Score from which people are taken to call an object good: the middle of 0 to 10."""
LEAST_PAIRS = 3
"""Least variants for a correlation: two always lie on a line."""
COLUMNS = ["run_id", "asset_id", "method", "model", "status", "failure_mode", "reason"]


@dataclass(frozen=True)
class RatedVariant:
    """A variant with its mean rating (0 to 10), what raters wrote, and our verdict on it: whether it passes, and else
    why not. ``passes`` of an asset that several models refined by the same method is their share where no one of them
    was what was rated."""

    asset_id: str
    method: str
    model: str
    rating: float
    raters: int
    notes: tuple[str, ...]
    passes: float
    reason: str

    @property
    def disagrees(self) -> bool:
        """Whether people call it good and our checks do not, or the reverse."""
        return (self.rating >= MIDDLE) != (self.passes > 0.5)


@dataclass(frozen=True)
class VerdictFigures:
    """Correlation (Pearson's r; NaN where undefined) of mean ratings with passing, and the mean rating of what passes
    and of what fails (NaN where nothing does)."""

    r: float
    n: int
    of_passes: float
    of_failures: float


def verdicts_of(folders: Sequence[Path | str]) -> pd.DataFrame:
    """Our verdicts on every asset of output folders, by run: those of earlier runs from the history. ``latest`` marks
    what is in a folder now. Raises UsageError for a folder without a catalog."""
    found = []
    for folder in folders:
        now = read_table(folder, "assets")[COLUMNS].assign(latest=True)
        before = read_table(folder, "asset_history")[COLUMNS].assign(latest=False)
        found.append(pd.concat([now, before]).drop_duplicates(COLUMNS[:4]))
    return pd.concat(found, ignore_index=True)


def rated_variants(rated: pd.DataFrame, verdicts: pd.DataFrame) -> list[RatedVariant]:
    """Every variant of ``joined`` ratings on which there is a verdict: that of the run that was rated, or, where the
    run is not known, those in the folders now of the same asset and method."""
    found = []
    runs = {tuple(row[:4]): row[4:] for row in verdicts[COLUMNS].itertuples(index=False, name=None)}
    latest = verdicts[verdicts["latest"]]
    for (asset_id, method, model, run_id), some in rated.groupby(
        ["asset_id", "method", "model", "run_id"], dropna=False
    ):
        if isinstance(run_id, str):
            key = (run_id, asset_id, method, model)
            of_it = [runs[key]] if key in runs else []
        else:
            same = latest[(latest["asset_id"] == asset_id) & (latest["method"] == method)]
            of_it = list(same[COLUMNS[4:]].itertuples(index=False, name=None))
        if of_it:
            reasons = dict.fromkeys(f"{mode}: {reason}" for status, mode, reason in of_it if status != Status.OK)
            passes = sum(status == Status.OK for status, *_ in of_it) / len(of_it)
            notes = tuple(note for note in some["note"] if note)
            mean, raters = float(some["score"].mean()), some["rater"].nunique()
            named = str(asset_id), str(method), str(model)
            found.append(RatedVariant(*named, mean, raters, notes, passes, "; ".join(reasons)))
    return found


def verdict_figures(variants: Sequence[RatedVariant]) -> VerdictFigures:
    """How the ratings go with our verdicts."""
    ratings, passes = (np.array([getattr(item, name) for item in variants], float) for name in ("rating", "passes"))
    enough = len(variants) >= LEAST_PAIRS and np.ptp(ratings) > 0.0 and np.ptp(passes) > 0.0
    means = [float(some.mean()) if len(some) else math.nan for some in (ratings[passes > 0.5], ratings[passes <= 0.5])]
    return VerdictFigures(float(pearsonr(ratings, passes).statistic) if enough else math.nan, len(variants), *means)


def disagreements(variants: Sequence[RatedVariant]) -> list[RatedVariant]:
    """Where people and our checks disagree, by asset, the widest apart first."""
    return sorted(
        (item for item in variants if item.disagrees), key=lambda item: (item.asset_id, -abs(item.rating - MIDDLE))
    )


STAGES = ("score_before", "score_untouched", "score_touched")
NOTHING_RATED = "nothing is rated or scored"


def describe_ratings(outs: Sequence[Path | str], published: Path | None) -> list[RenderableType]:
    """The ratings, video scores and probe trials of output folders, then published ones, as tables and lines for the
    terminal. Raises UsageError where nothing is rated or named, for a folder without a catalog, and for a rating
    without key."""
    verdicts = verdicts_of(variant_folders(outs)) if outs else None
    parts: list[RenderableType] = []
    if outs:
        tables = [
            pd.concat([read_own_files(out, table) for out in outs], ignore_index=True)
            for table in (RATINGS, RATING_KEYS, VIDEO_SCORES)
        ]
        parts += _ratings("Ratings", joined(*tables[:2]), verdicts) + describe_scores("Video scores", tables[2])
        parts += describe_probes(latest_own(outs, PROBE_TRIALS), real_rates(published))
    if published is not None:
        found = joined(*published_ratings(published))
        parts += _ratings("Published ratings", found, verdicts)
        parts += describe_scores("Published video scores", published_videos(published))
        if (published / SUCCESS_FILE).is_file():
            title = "Published behavioural fidelity"
            parts += describe_fidelity(title, published_rates(published), real_rates(published))
    if not parts:
        told = f"{', '.join(map(str, outs))}: {NOTHING_RATED}" if outs else "name an output folder, or --published"
        raise UsageError(f"{told}; asset2sim rate OUT opens the page on which people rate")
    return parts


def _ratings(title: str, rated: pd.DataFrame, verdicts: pd.DataFrame | None) -> list[RenderableType]:
    if rated.empty:
        return []
    names = variant_names(pairs_of(rated))
    headings = ("method", "mean", "95 % of it", "± raters", "± objects", "before", "untouched", "touched", "n")
    rows = [
        (
            *(names[item.method, item.model], _two(item.mean), span(item.low, item.high)),
            *(_two(value) for value in (item.over_raters, item.over_objects, *item.stages)),
            f"{item.raters} × {item.objects}",
        )
        for item in rating_figures(rated)
    ]
    alphas = [f"{_two(krippendorff_alpha(rater_matrix(rated)))} in all"]
    alphas += [
        f"{_two(krippendorff_alpha(rater_matrix(rated, name)))} {name.removeprefix('score_')}"
        for name in STAGES
        if rated[name].notna().any()
    ]
    lines = [f"agreement of raters (Krippendorff's alpha, interval): {', '.join(alphas)}"]
    order = order_effect(rated, ["rater", "asset_id"], ["asset_id", *VARIANT])
    lines += [_order("rating", order)] + ([] if verdicts is None else _verdicts(rated, verdicts))
    table = number_table(f"{title}, 0 to 10; n is raters × objects", headings, rows, left=1)
    return [table, Text("\n".join(lines))]


def _verdicts(rated: pd.DataFrame, verdicts: pd.DataFrame) -> list[str]:
    variants, names = rated_variants(rated, verdicts), variant_names(pairs_of(rated))
    if not variants:
        return ["no verdict of ours on what was rated"]
    figures = verdict_figures(variants)
    lines = [
        f"with our verdicts on {figures.n} variants: r = {_two(figures.r)}; mean rating of what passes "
        f"{_two(figures.of_passes)}, of what fails {_two(figures.of_failures)}"
    ]
    if rated["run_id"].isna().all():
        lines.append("(ratings of the paper's variants, verdicts on ours of the same assets and methods)")
    apart = disagreements(variants)
    lines.append(f"people and verdicts disagree on {len(apart)}" + (":" if apart else ""))
    for item in apart:
        said = "passes every check" if item.passes > 0.5 else f"fails ({item.reason})"
        notes = "".join(f" “{note}”" for note in item.notes)
        who = "rater" if item.raters == 1 else "raters"
        lines.append(
            f"  {item.asset_id}, {names[item.method, item.model]}: rated {_two(item.rating)} by {item.raters} {who}, "
            f"{said}{notes}"
        )
    return lines


def describe_scores(title: str, scores: pd.DataFrame) -> list[RenderableType]:
    """Scores of videos as a table, and lines on the order of the candidates and on trials without a score; nothing
    where there are none."""
    scores = latest_scores(scores)
    if scores.empty:
        return []
    names = variant_names(pairs_of(scores))
    rows = [
        (
            *(item.judge, names[item.method, item.model], f"{_two(item.mean)} ± {_two(item.plus_minus)}"),
            *(span(item.low, item.high), item.tasks, item.trials),
        )
        for item in video_figures(scores)
    ]
    headings = ("judge", "method", "mean ± as the paper", "95 % over tasks", "tasks", "trials")
    lines = []
    for judge, some in scores.groupby("judge"):
        if judge == PHYSICAL_JUDGE:
            lines.append(
                f"{PHYSICAL_JUDGE}: a formula over what was measured of the recordings; nobody looked at the films"
            )
            continue
        order = order_effect(some, [*TASK, "trial"], [*TASK, *VARIANT])
        lines.append(_order(f"score of {judge!s}", order))
        if order is not None:
            lines.append(f"  mean by place, the first first: {', '.join(map(_two, mean_by_place(some)))}")
        without = some[some["score"].isna()].drop_duplicates([*TASK, "trial"])
        for reason, times in without["reason"].value_counts().items():
            lines.append(f"  {times} {'trial' if times == 1 else 'trials'} without a score: {reason}")
    return [number_table(f"{title}, 0 to 5", headings, rows, left=2), Text("\n".join(lines))]


def _order(what: str, found: OrderEffect | None) -> str:
    if found is None:
        return f"effect of the order on the {what}: not known (no orders, or none in which it changes)"
    return (
        f"effect of the order on the {what}: {found.slope:+.2f} a place (permutation p = {found.p:.2g}, n = {found.n})"
    )


def pairs_of(rows: pd.DataFrame) -> list[tuple[str, str]]:
    """Each method and model of rows, once."""
    return sorted(set(zip(rows["method"], rows["model"], strict=True)))


def _two(value: float) -> str:
    return f"{value:.2f}" if significant(value) != NOTHING else NOTHING
