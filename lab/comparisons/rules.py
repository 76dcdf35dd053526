"""The table of the same objects raw, in our pipeline with the paper's ranges of joint terms, and by our rules. Pure."""

from collections.abc import Mapping

import pandas as pd

from asset2sim.catalog.text import NOTHING, markdown_table, percent
from asset2sim.checks.declared_check import known_checks
from lab.comparisons.figure_specs import ZERO_MM
from lab.comparisons.object_rows import drift_passes, oscillation_passes, true_of
from schemas.settings import Settings, Thresholds
from schemas.vocabulary import CollisionMode, DynamicsRule, Engine, Method

BLOCK = "rules"
"""Name of the page's block."""
RAW, PAPER, OURS = "raw", "ours, the paper's ranges", "ours"
"""The second is not the paper's method: its ranges of joint terms and its loop over positions, in our pipeline."""
CHECKS: dict[str, str] = {mode.value: check.name for check in known_checks() if check.judge for mode in check.modes}
"""Interaction check, by its failure mode → its column heading, in the table's order."""
KEY = ["asset_id", "engine"]


def settings_of(ours: Settings) -> dict[str, Settings]:
    """Settings of the three runs of a dataset, in the table's order. The second has the paper's absolute ranges for
    joint dynamics, collision shapes as authored, and a loop over joint positions alone: no shape is cleared and no term
    mended for what interaction finds. Prompt, validation and checks stay ours: it is not the paper's method."""
    paper = ours.model_copy(
        update={
            "physics": ours.physics.model_copy(update={"dynamics": DynamicsRule.PAPER}),
            "collision": ours.collision.model_copy(update={"mode": CollisionMode.KEEP}),
            "search": ours.search.model_copy(update={"mend_rounds": 0}),
        }
    )
    return {RAW: ours.model_copy(update={"method": Method.RAW}), PAPER: paper, OURS: ours}


def engine_results(
    assets: pd.DataFrame, measured: pd.DataFrame, interactions: pd.DataFrame, limits: Thresholds
) -> pd.DataFrame:
    """A row for every asset in every engine that any of them was measured in, from one run's tables. ``loaded`` is
    False if the engine refused the object, or the run failed before loading it: it then passes nothing. ``checked``
    says whether interaction checks were run; a column for each says whether it passed, or did not apply."""
    engines = [engine.value for engine in Engine if engine.value in set(measured["engine"])]
    every = pd.MultiIndex.from_product([assets["asset_id"], engines], names=KEY)
    rows = measured.set_index(KEY).reindex(every)
    loaded = rows["penetration_mm"].notna()
    applied = interactions[interactions["test"].isin(list(CHECKS)) & interactions["passed"].notna()]
    passes = applied.astype({"passed": bool}).groupby([*KEY, "test"])["passed"].all().unstack("test")
    # Null: it did not apply.
    passes = passes.reindex(index=every, columns=list(CHECKS))
    checked = loaded & passes.notna().any(axis=1)
    results = {
        "loaded": loaded,
        "penetration_mm": rows["penetration_mm"].astype("float64"),
        "still": loaded & drift_passes(rows, limits),
        "steady": loaded & oscillation_passes(rows),
        "passed": loaded & true_of(rows["passed"]),
        "checked": checked,
        **{name: checked & passes[name].ne(False) for name in CHECKS},
    }
    return pd.DataFrame(results).reset_index()


def rules_table(rules: Mapping[str, pd.DataFrame]) -> str:
    """The Markdown table: a row for each engine and rule. Shares are of all objects: what does not load passes nothing.
    A check that does not apply to an object (a hold where no joint must hold) counts as passed; penetration is the mean
    over the loaded objects whose Φ is not zero."""
    headings = ["engine", "rules", "objects", "loads", "Φ mm", "drift", "oscillation", *CHECKS.values(), "every test"]
    found = [
        (engine.value, name, own[own["engine"] == engine.value]) for engine in Engine for name, own in rules.items()
    ]
    return markdown_table(headings, [[engine, name, *cells(own)] for engine, name, own in found if len(own)])


def cells(own: pd.DataFrame) -> list[str]:
    """One row's figures, of the same engine and rules."""
    deep = own.loc[own["penetration_mm"] > ZERO_MM, "penetration_mm"]

    def share(column: str) -> str:
        return percent(int(own[column].sum()), len(own))

    return [
        str(len(own)),
        share("loaded"),
        f"{deep.mean():.3g}" if len(deep) else ("0" if own["loaded"].any() else NOTHING),
        share("still"),
        share("steady"),
        *(share(name) if own["checked"].any() else NOTHING for name in CHECKS),
        share("passed"),
    ]
