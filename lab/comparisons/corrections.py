"""The table of what correcting a model's answer, and asking it again, is worth. Pure."""

from collections.abc import Mapping

import pandas as pd

from asset2sim.catalog.text import NOTHING, markdown_table
from schemas.alignment import NOTHING as NOTHING_ASKED
from schemas.alignment import SIZE
from schemas.model_names import described, is_recorded
from schemas.settings import DoubtSettings, Settings
from schemas.vocabulary import Correction, Status

BLOCK = "corrections"
"""Name of the page's block."""
SAMPLES = 3
"""Answers of the last way."""
AGAIN, SAMPLED = "units, asked again", f"units, asked again, {SAMPLES} samples"


def ways_of(base: Settings, model: str) -> dict[str, Settings]:
    """Name → settings of every way to take a model's answers. A recorded one cannot be asked again."""
    named = base.model_copy(update={"model": base.model.model_copy(update={"model": model})})
    once = named.model_copy(update={"doubt": DoubtSettings(ask_again=False)})
    ways = {mode.value: once.model_copy(update={"correct": mode}) for mode in Correction}
    if is_recorded(model):
        return ways
    units = named.model_copy(update={"correct": Correction.UNITS})
    for name, samples in ((AGAIN, 1), (SAMPLED, SAMPLES)):
        ways[name] = units.model_copy(update={"doubt": DoubtSettings(ask_again=True, samples=samples)})
    return ways


def corrections_table(runs: Mapping[tuple[str, str], tuple[pd.DataFrame, pd.DataFrame]]) -> str:
    """A Markdown table with a row for each (model, way) → (assets, expectations)."""
    headings = ["model", "correct", "objects", "ok", "sizes", "joints at the start", "joints at rest", "calls an asset"]
    return markdown_table(headings, [[described(model), way, *figures(*found)] for (model, way), found in runs.items()])


def figures(assets: pd.DataFrame, expected: pd.DataFrame) -> list[str]:
    """Objects, those that are ok, sizes and joints as expected of how many, and model calls an asset. What swings
    counts at rest as it was at the start."""
    sizes = expected[expected["what"] == SIZE]
    joints = expected[~expected["what"].isin((SIZE, NOTHING_ASKED))]
    at_rest = joints["met_at_rest"].where(joints["met_at_rest"].notna(), joints["met_at_start"])
    good = int((assets["status"] == Status.OK.value).sum())
    met = (sizes["met_at_start"], joints["met_at_start"], at_rest)
    calls = f"{assets['queries'].mean():.2f}" if len(assets) else NOTHING
    return [str(len(assets)), str(good), *map(share_met, met), calls]


def share_met(met: "pd.Series[bool]") -> str:
    """How many are met, of those that could be held against anything."""
    known = met.dropna()
    return f"{int(known.astype(bool).sum())} of {len(known)}"
