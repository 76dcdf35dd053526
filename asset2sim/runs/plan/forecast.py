"""Forecast of a run: the plan, each asset's reason, and calls, tokens, cost and time by what they were before."""

import json
from collections import defaultdict
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from asset2sim.assets.urdf.references import allowed_folders
from asset2sim.catalog.query import packaged_sql
from asset2sim.catalog.read import query, read_table
from asset2sim.catalog.run import UNRECORDED_SETTINGS, without_credentials
from asset2sim.catalog.switch import find_catalog
from asset2sim.models.gateway.budget import price_of
from asset2sim.runs.plan.content_hash import IRRELEVANT_SETTINGS, package_versions
from asset2sim.runs.plan.plan import Plan, Why, make_plan
from asset2sim.runs.plan.state import changed_inputs, read_state
from schemas.asset import AssetRef
from schemas.errors import first_words
from schemas.location import Location
from schemas.model_names import is_prior, settings_for
from schemas.settings import Settings
from schemas.vocabulary import Status

MAX_FILES = 3
"""Files or settings that a reason names."""


@dataclass(frozen=True)
class ForecastCost:
    """Cost of a run: model calls at most (cached ones included), tokens, cost, work and wall time, s; None: not known.
    ``assets`` is how many refinements this is read from, ``others`` whether of another model."""

    assets: int
    others: bool = False
    calls: float | None = None
    prompt_tokens: float | None = None
    completion_tokens: float | None = None
    cost_usd: float | None = None
    work_s: float | None = None
    wall_s: float | None = None


@dataclass(frozen=True)
class Forecast:
    """A run that is not made: its plan, the reasons with the ids of their assets, those that are left alone although
    they failed, and what the run would take."""

    plan: Plan
    reasons: Mapping[str, Sequence[str]]
    failing: Sequence[str] = ()
    expected: ForecastCost = field(default_factory=lambda: ForecastCost(0))


def forecast(
    refs: Sequence[AssetRef], out: Path, settings: Settings, pipeline: str, there: Mapping[str, str] | None = None
) -> Forecast:
    """Forecast of what a run over these assets would do to ``out``, a folder with OUT's tables; writes nothing."""
    plan = make_plan(refs, out, settings, pipeline, there, dry=True)
    reasons: dict[str, list[str]] = defaultdict(list)
    changed = [ref for ref in plan.todo if plan.why[ref.asset_id] is Why.CHANGED]
    found = why_changed(changed, out, settings) if changed else {}
    for asset_id, why in plan.why.items():
        reasons[found.get(asset_id, why.value)].append(asset_id)
    failing = [item.asset_id for item in plan.unchanged if item.status is Status.FAILED]
    return Forecast(plan, reasons, failing, expected_cost(plan.todo, out, settings))


def why_changed(refs: Sequence[AssetRef], out: Path, settings: Settings) -> dict[str, str]:
    """Asset id → what of it is not as it was when it was refined, as far as that is recorded."""
    rows = read_table(out, "assets")
    mine = rows[(rows["method"] == settings.method.value) & (rows["model"] == settings.model.model)]
    was = mine.set_index("asset_id")[["run_id", "prompt", "subset", "overrides"]].to_dict("index")
    runs = read_table(out, "runs").set_index("run_id").to_dict("index")
    by_run = {
        run_id: changed_of_run(runs[run_id], settings)
        for run_id in {row["run_id"] for row in was.values()} & runs.keys()
    }
    found = {}
    with read_state(out) as state:
        for ref in refs:
            row = was[ref.asset_id]
            parts = list(by_run.get(row["run_id"], ()))
            if not Location(ref.path).is_url and (
                files := changed_inputs(state, Path(ref.path), allowed_folders(ref, settings.inputs))
            ):
                parts.insert(0, f"files {first_words(files, MAX_FILES)}")
            for name, now in (("prompt", ref.prompt), ("subset", ref.subset), ("overrides", ref.own_numbers)):
                if (None if pd.isna(row[name]) else row[name]) != now:
                    parts.insert(0, f"its {name}")
            found[ref.asset_id] = f"changed: {', '.join(parts) or 'the code, its manifest row or its files'}"
    return found


def changed_of_run(run: Mapping[Hashable, Any], settings: Settings) -> list[str]:
    """Inputs that all assets of an earlier run share and is another now: settings and packages."""
    then, now = json.loads(run["settings_json"]), _recorded(settings)
    parts = []
    if names := sorted(name for name in then.keys() | now.keys() if then.get(name) != now.get(name)):
        nested = [f"{name}.{inner}" for name in names for inner in _different(then.get(name), now.get(name))]
        nested = [name for name in nested if not _is_irrelevant(name)]
        if nested or any(not _is_irrelevant(name) for name in names):
            parts.append(f"settings {first_words(nested or names, MAX_FILES)}")
    versions = json.loads(run["versions_json"])
    packages = [name for name, version in package_versions(settings.engine).items() if versions.get(name) != version]
    return [*parts, f"packages {first_words(packages, MAX_FILES)}"] if packages else parts


def expected_cost(todo: Sequence[AssetRef], out: Path, settings: Settings) -> ForecastCost:
    """Cost of refining these assets, by what their refinements took, else those of their category, else all."""
    if not todo or find_catalog(out) is None:
        return ForecastCost(0)
    rows = query(out, packaged_sql("forecast"), (settings.method.value,))
    own = rows[rows["model"] == settings.model.model]
    others = own.empty
    rows = (rows.drop_duplicates("asset_id") if others else own).set_index("asset_id")
    if rows.empty:
        return ForecastCost(0)
    by_category = rows.groupby("category")[["calls", "seconds"]].mean()
    guesses = [_guess(ref, rows, by_category) for ref in todo]
    calls, work = sum(guess[0] for guess in guesses), sum(guess[1] for guess in guesses)
    paid = float(rows["paid_calls"].sum())
    sent, said = (
        calls * float(rows[name].sum()) / paid if paid else None for name in ("prompt_tokens", "completion_tokens")
    )
    price = price_of(settings_for(settings.model, settings.model.model))
    cost: float | None = 0.0 if is_prior(settings.model.model) else None
    if not others and paid:
        cost = calls * float(rows["cost_usd"].sum()) / paid
    elif price is not None and sent is not None and said is not None:
        cost = sent * price.prompt_usd + said * price.answer_usd
    wall = max(work / settings.run.workers, max(guess[1] for guess in guesses))
    return ForecastCost(len(rows), others, calls, sent, said, cost, work, wall)


def _guess(ref: AssetRef, rows: pd.DataFrame, by_category: pd.DataFrame) -> tuple[float, float]:
    """Calls and seconds of one asset."""
    if ref.asset_id in rows.index:
        row = rows.loc[[ref.asset_id], ["calls", "seconds"]].mean()
    elif ref.category in by_category.index:
        row = by_category.loc[[ref.category]].mean()
    else:
        row = rows[["calls", "seconds"]].mean()
    return float(row["calls"]), float(row["seconds"])


def _recorded(settings: Settings) -> dict[str, Any]:
    """The settings as the table of runs has them."""
    found: dict[str, Any] = json.loads(without_credentials(settings.model_dump_json(exclude=UNRECORDED_SETTINGS)))
    return found


def _different(then: object, now: object) -> list[str]:
    if not isinstance(then, dict) or not isinstance(now, dict):
        return []
    return sorted(name for name in then.keys() | now.keys() if then.get(name) != now.get(name))


def _is_irrelevant(name: str) -> bool:
    section, _, inner = name.partition(".")
    left_out = IRRELEVANT_SETTINGS.get(section, set())
    return left_out is True or (isinstance(left_out, set) and inner in left_out)
