"""Figures of many trials for each method: tasks done, faults, the physical judge's score."""

from collections.abc import Collection
from dataclasses import dataclass

import pandas as pd

from asset2sim.gym.arm.tasks import PAPER
from lab.trials.physical_judge import FAULTS
from schemas.vocabulary import Method

METHODS = (Method.REFERENCE, Method.IVW, Method.DIRECT, Method.ASSET2SIM)
ORDER = {method.value: place for place, method in enumerate(METHODS)}
DONE = "done"


def methods_of(rows: pd.DataFrame) -> list[str]:
    """The methods of rows, in the paper's order; others follow by name."""
    return sorted(map(str, set(rows["method"])), key=lambda name: (ORDER.get(name, len(ORDER)), name))


def variant_names(pairs: Collection[tuple[str, str]]) -> dict[tuple[str, str], str]:
    """(method, model) → what to call it: the method, and its model where it was run with several."""
    methods = [method for method, _ in {*pairs}]
    return {(method, model): f"{method}, {model}" if methods.count(method) > 1 else method for method, model in pairs}


@dataclass(frozen=True)
class MethodTrials:
    """One method's trials: how many tasks there were, were done, and were recorded at all; how many had each of
    ``FAULTS``; the mean score over all tasks, where what was not recorded has 0."""

    method: str
    model: str
    tasks: int
    done: int
    recorded: int
    faults: tuple[int, ...]
    score: float


def method_figures(trials: pd.DataFrame) -> list[MethodTrials]:
    """A row per method and model, in the paper's order; others follow by name."""
    found = []
    for (method, model), rows in trials.groupby(["method", "model"], sort=False):
        faults = tuple(int(rows[fault].fillna(False).sum()) for fault in FAULTS)
        done, recorded = int((rows["outcome"] == DONE).sum()), int(rows["score"].notna().sum())
        score = float(rows["score"].astype(float).fillna(0.0).mean())
        found.append(MethodTrials(str(method), str(model), len(rows), done, recorded, faults, score))
    return sorted(found, key=lambda item: (ORDER.get(item.method, len(ORDER)), item.method, item.model))


def task_rows(trials: pd.DataFrame) -> list[tuple[str, dict[tuple[str, str], str]]]:
    """Each task, in the paper's order first, with what became of it by method and model: ``done``, or why not, and the
    faults."""
    order = {task.name: place for place, task in enumerate(task for tasks in PAPER.values() for task in tasks)}
    found: dict[tuple[int, str], dict[tuple[str, str], str]] = {}
    for row in trials.to_dict("records"):
        name = str(row["task"]) if row["task"] in order else f"{row['task']} {row['asset_id']}"
        faults = [fault.heading for name, fault in FAULTS.items() if row[name] is True]
        cells = found.setdefault((order.get(str(row["task"]), len(order)), name), {})
        cells[str(row["method"]), str(row["model"])] = "; ".join([str(row["outcome"]), *faults])
    return [(name, cells) for (_, name), cells in sorted(found.items())]
