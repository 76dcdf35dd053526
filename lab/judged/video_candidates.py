"""Candidates of video judges: the films of the same task with the same asset by several methods, and the orders of
their trials."""

import hashlib
import itertools
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from lab.judged.published import NO_MODEL
from lab.judged.variant_folders import variant_folders
from lab.runner import latest_own
from lab.schemas.tables import TRIALS
from lab.trials.study import motion_folder
from lab.trials.trial import FILM
from schemas.errors import UsageError
from schemas.location import Location


@dataclass(frozen=True)
class Candidate:
    """A film, and how its object was refined: known here, and to no judge."""

    method: str
    model: str
    run_id: str | None
    film: Path


REAL = "real"
"""The method that a film of reality is a row of, as in the paper's tables."""


@dataclass(frozen=True)
class TaskComparison:
    """A task with an asset: the candidates by method and model, and a line on each variant that has no film."""

    task: str
    asset_id: str
    verb: str
    candidates: tuple[Candidate, ...]
    missing: tuple[str, ...]


def recorded_trials(outs: Sequence[Path | str]) -> pd.DataFrame:
    """The latest trial of each task, asset, method and model in output folders or in that of a comparison, with the
    column ``out``, its output folder. Raises UsageError where nothing is recorded, for a URL, which holds no films, and
    where two folders hold the same variant of a task."""
    frames = []
    for out in variant_folders(outs):
        if Location(out).is_url:
            raise UsageError(f"{out}: films are judged where they were recorded; name a folder on this machine")
        frames.append(latest_own([Path(out)], TRIALS).assign(out=str(out)))
    found = pd.concat(frames, ignore_index=True)
    if found.empty:
        raise UsageError(f"{', '.join(map(str, outs))}: no recorded interaction; asset2sim record-motion makes them")
    key = list(TRIALS.key)
    twice = found[found.duplicated(key, keep=False)]
    if len(twice):
        task, asset_id, method, model = twice.iloc[0][key]
        where = " and ".join(twice.loc[(twice[key] == twice.iloc[0][key]).all(axis=1), "out"])
        raise UsageError(f"{where} both hold '{task}' with asset {asset_id} by {method}, {model}; name one of them")
    return found.sort_values(key, ignore_index=True)


def comparisons(trials: pd.DataFrame, real: Path | None = None) -> list[TaskComparison]:
    """A comparison for each task and asset of ``recorded_trials``; a task's film of reality, ``real``/TASK.mp4 with
    dashes for spaces, is its first candidate. Raises UsageError where the folder has no film of any task."""
    films = {} if real is None else {task: real / f"{task.replace(' ', '-')}.mp4" for task in set(trials["task"])}
    films = {task: film for task, film in films.items() if film.is_file()}
    if real is not None and not films:
        wanted = ", ".join(sorted(f"{task.replace(' ', '-')}.mp4" for task in set(trials["task"])))
        raise UsageError(f"{real}: no film of a task that was recorded; name one of them {wanted}")
    found = []
    for (task, asset_id), some in trials.groupby(["task", "asset_id"]):
        candidates = [Candidate(REAL, NO_MODEL, None, films[task])] if task in films else []
        missing = []
        for row in some.to_dict("records"):
            film = motion_folder(Path(row["out"]), str(asset_id), str(task)) / FILM
            run_id = row["run_id"] if isinstance(row["run_id"], str) else None
            if film.is_file():
                candidates.append(Candidate(row["method"], row["model"], run_id, film))
            else:
                why = (
                    ": ".join(filter(None, (row["outcome"], row["reason"]))) if row["outcome"] != "done" else "no film"
                )
                missing.append(f"{row['method']}, {row['model']}: {why}")
        verb = str(some["verb"].iloc[0])
        found.append(TaskComparison(str(task), str(asset_id), verb, tuple(candidates), tuple(missing)))
    return found


def trial_seeds(about: TaskComparison, trials: int, seed: int) -> tuple[int, ...]:
    """A seed for each trial, from 1 to 2³¹ − 1, of ``seed``, the task, the asset and who the candidates are. No order
    comes twice before every other one has come."""
    who = [[item.method, item.model] for item in about.candidates]
    drawn = sum(item.method != REAL for item in about.candidates)
    used, found, every = set[tuple[int, ...]](), list[int](), math.factorial(drawn)
    for trial in range(trials):
        for attempt in itertools.count():
            text = json.dumps([seed, about.task, about.asset_id, who, trial, attempt])
            number = max(1, int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big") >> 1)
            if (order := shuffled(number, drawn)) not in used:
                break
        used.add(order)
        if len(used) == every:
            used.clear()
        found.append(number)
    return tuple(found)


def order_of(candidates: Sequence[Candidate], seed: int) -> list[Candidate]:
    """The candidates in the order of a trial's seed, after the film of reality where there is one, as in the paper."""
    first = [item for item in candidates if item.method == REAL]
    rest = [item for item in candidates if item.method != REAL]
    return first + [rest[index] for index in shuffled(seed, len(rest))]


def shuffled(seed: int, count: int) -> tuple[int, ...]:
    """The order of a trial's seed: which of ``count`` candidates stands at each place."""
    return tuple(int(index) for index in np.random.default_rng(seed).permutation(count))
