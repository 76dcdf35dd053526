"""Probe trials as Markdown for pages: trials done by task, and a short table that says who acted."""

import pandas as pd

from asset2sim.catalog.text import NOTHING, markdown_table
from lab.judged.fidelity import rates_of
from lab.trials.figures import methods_of

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
