"""Policies' results by method, for people: rates, correlations with reality, agreement, and what went wrong."""

import math
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from rich.console import RenderableType
from rich.text import Text

from asset2sim.catalog.text import NOTHING, markdown_table, number_table
from lab.judged.fidelity import (
    REAL,
    Correlation,
    FidelityFigure,
    RateAgreement,
    agreements,
    fidelity_figures,
    rates_of,
    smallest_r,
)
from lab.judged.published import SUCCESS_FILE, published_rates
from lab.trials.figures import methods_of, variant_names
from lab.trials.physical_judge import FAULTS

HEADINGS = ("policy", "method", "success, %", "95 % over tasks", "SRCC", "95 %", "p", "tasks", "trials")
ENDED = ("done", "not done")


def real_rates(published: Path | None) -> pd.DataFrame:
    """Rates of policies in reality, of a folder of the paper's tables that has them; else none."""
    if published is None or not (published / SUCCESS_FILE).is_file():
        return pd.DataFrame(columns=["policy", "method", "model", "task", "rate", "trials"])
    rates = published_rates(published)
    return rates[rates["method"] == REAL]


def describe_fidelity(title: str, rates: pd.DataFrame, real: pd.DataFrame) -> list[RenderableType]:
    """Success rates (``rates_of``) as a table and lines that say how far to trust it; nothing where there are none."""
    if rates.empty:
        return []
    figures = fidelity_figures(rates, real)
    return [number_table(title, HEADINGS, rows_of(figures), left=2), Text("\n".join(_caution(figures, rates)))]


def describe_probes(trials: pd.DataFrame, real: pd.DataFrame) -> list[RenderableType]:
    """The latest rows of a table ``probe_trials``: figures, agreement of methods, and faults found in recordings."""
    rates = rates_of(trials)
    parts = describe_fidelity("Behavioural fidelity", rates, real)
    rows = fault_rows(trials)
    if rows:
        parts.append(number_table("In the recordings, trials", fault_headings(trials), rows, left=2))
    return parts


def fidelity_block(trials: pd.DataFrame, real: pd.DataFrame) -> str:
    """The same as Markdown, with the tasks of each policy."""
    rates = rates_of(trials)
    figures = fidelity_figures(rates, real)
    parts = [markdown_table(HEADINGS, rows_of(figures), range(2, len(HEADINGS)))]
    parts.append("\n".join(f"- {line}" for line in _caution(figures, rates)))
    headings = fault_headings(trials)
    parts.append(markdown_table(headings, fault_rows(trials), range(2, len(headings))))
    return "\n\n".join([*parts, task_tables(trials)])


def rows_of(figures: Sequence[FidelityFigure]) -> list[tuple[str, ...]]:
    """A row per policy and method, as the paper's table has them."""
    names = variant_names([(item.method, item.model) for item in figures])
    return [
        (
            *(item.policy, names[item.method, item.model], f"{100.0 * item.mean:.2f}"),
            *(span(100.0 * item.low, 100.0 * item.high, 0), *_correlated(item.srcc), str(item.tasks), str(item.trials)),
        )
        for item in figures
    ]


def fault_headings(trials: pd.DataFrame) -> tuple[str, ...]:
    """Headings of ``fault_rows``: faults, then the ends that are no result."""
    return ("policy", "method", "trials", *(fault.heading for fault in FAULTS.values()), *_ends(trials))


def fault_rows(trials: pd.DataFrame) -> list[tuple[str, ...]]:
    """By policy and method: how many trials, how many had each fault, and how many ended without a result, and how."""
    return [
        (
            *(str(policy), str(method), str(len(some))),
            *(str(int(some[fault].fillna(False).astype(bool).sum())) for fault in FAULTS),
            *(str(int((some["outcome"] == end).sum())) for end in _ends(trials)),
        )
        for (policy, method), some in trials.groupby(["policy", "method"])
    ]


def _ends(trials: pd.DataFrame) -> list[str]:
    return sorted(set(trials["outcome"].dropna()) - set(ENDED))


def _correlated(found: Correlation | None) -> tuple[str, str, str]:
    if found is None:
        return NOTHING, NOTHING, NOTHING
    if found.undefined:
        return f"undefined ({found.undefined})", NOTHING, NOTHING
    return f"{found.r:.2f}", span(found.low, found.high), f"{found.p:.2f}"


def _caution(figures: Sequence[FidelityFigure], rates: pd.DataFrame) -> list[str]:
    """How little eleven points are, which intervals miss resamples, and how methods agree where nothing acted in
    reality."""
    lines = []
    known = [item.srcc for item in figures if item.srcc is not None]
    if known:
        n = max(item.n for item in known)
        lines.append(
            f"SRCC is Pearson's r over {n} tasks, which is little: below |r| = {smallest_r(n):.2f} it is not told from "
            f"none at 5 %, and {len(known)} were computed"
        )
    lost = [
        f"{item.policy}, {item.method}: {item.srcc.lost:.0%}" for item in figures if item.srcc and _lossy(item.srcc)
    ]
    if lost:
        lines.append(f"resamples without variance, left out of the interval of r: {'; '.join(lost)}")
    unreal = {item.policy for item in figures if item.srcc is None and item.method != REAL}
    for item in agreements(rates[rates["policy"].isin(unreal)]):
        lines.append(_agreed(item))
    if unreal:
        names = ", ".join(sorted(unreal))
        lines.append(
            f"no SRCC of {names}: no success in reality is known of that policy, so methods are compared alone"
        )
    return lines


def _lossy(found: Correlation) -> bool:
    return not found.undefined and found.lost > 0.01


def _agreed(item: RateAgreement) -> str:
    said = "no variance" if math.isnan(item.r) else f"r = {item.r:.2f}, ρ = {item.rho:.2f}"
    return f"{item.policy}: success with {item.first} and with {item.second} over {item.n} tasks: {said}"


def span(low: float, high: float, digits: int = 2) -> str:
    """An interval in words; a dash where it is not known."""
    return NOTHING if math.isnan(low) else f"{low:.{digits}f} to {high:.{digits}f}"


NOT_RUN = "not run"


def task_tables(trials: pd.DataFrame) -> str:
    """For each policy: tasks by methods, trials done of those with a result (latest rows of ``probe_trials``)."""
    parts = []
    for policy, some in trials.groupby("policy"):
        methods = methods_of(some)
        rows = [
            [str(task), *(done_of(own[own["method"] == method]) for method in methods)]
            for task, own in some.groupby("task", sort=False)
        ]
        table = markdown_table((f"{policy}: done", *methods), rows, range(1, len(methods) + 1))
        parts.append(table)
    return "\n\n".join(parts)


def short_block(trials: pd.DataFrame, published: pd.DataFrame | None) -> str:
    """Policies by methods: the mean of tasks' success rates and, in brackets, trials. Policies of the ``published``
    rates (the form of ``rates_of``) that have no trial are named as not run, with the published mean."""
    rates = rates_of(trials)
    methods = methods_of(trials)
    rows = []
    for policy, some in rates.groupby("policy"):
        rows.append([str(policy), *(mean_of(some[some["method"] == method], counted=True) for method in methods)])
    known = rates[:0] if published is None else published
    for policy, some in known[~known["policy"].isin(rates["policy"])].groupby("policy"):
        shown = [mean_of(some[some["method"] == method], counted=False) for method in methods]
        rows.append([f"{policy}: {NOT_RUN}; the paper's", *shown])
    return markdown_table(("policy", *methods), rows, range(1, len(methods) + 1))


def done_of(trials: pd.DataFrame) -> str:
    """How many trials were done of those that have a result; of none a dash."""
    known = trials["success"].dropna().astype(bool)
    return f"{int(known.sum())} of {len(known)}" if len(known) else NOTHING


def mean_of(rates: pd.DataFrame, *, counted: bool) -> str:
    """The mean rate over tasks, and how many trials that is of."""
    if rates.empty:
        return NOTHING
    said = f"{100.0 * rates['rate'].mean():.0f} %"
    return f"{said} ({int(rates['trials'].sum())})" if counted else said
