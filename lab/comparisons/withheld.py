"""The table of what the prior's tables are worth: the same objects with their labels withheld, and with each
category left out of the tables. Pure."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from asset2sim.catalog.text import NOTHING, markdown_table, percent
from schemas.vocabulary import Status

BLOCK = "withheld"
"""Name of the page's block."""
WHOLE, UNLABELLED, LEFT_OUT = "nothing", "labels and categories", "its own category's rows"
SIZE_FACTOR = 1.5
"""Factor within which two sizes count as the same."""
STATE_SHARE = 0.1
"""Share of a joint's range within which two states count as the same: the state check's."""


def withheld_table(
    runs: Sequence[tuple[str, pd.DataFrame, pd.DataFrame]], categories: Sequence[tuple[str, pd.DataFrame]]
) -> str:
    """Two Markdown tables from runs as (what is withheld, assets, joints), the first being the whole one: what becomes
    of all objects, and of each category whose own rows are left out, as (category, assets)."""
    whole = runs[0]
    rows = [[name, *outcome(assets), *agreement(assets, joints, whole)] for name, assets, joints in runs]
    first = markdown_table(
        ["withheld", "objects", "ok", "share", "same size", "same asked states", "fixed", "failures"], rows
    )
    single = [[name, *outcome(assets), failures(assets)] for name, assets in categories]
    return f"{first}\n\n{markdown_table(['category left out', 'objects', 'ok', 'share', 'failures'], single)}"


def outcome(assets: pd.DataFrame) -> list[str]:
    """Number of objects, how many are ok, and their share."""
    good = int((assets["status"] == Status.OK.value).sum())
    return [str(len(assets)), str(good), percent(good, len(assets))]


def failures(assets: pd.DataFrame) -> str:
    """The failed objects with their failure modes."""
    failed = assets[assets["status"] != Status.OK.value].sort_values("asset_id")
    return ", ".join(f"{row.asset_id} {row.failure_mode}" for row in failed.itertuples()) or NOTHING


def agreement(assets: pd.DataFrame, joints: pd.DataFrame, whole: tuple[str, pd.DataFrame, pd.DataFrame]) -> list[str]:
    """Shares of objects whose size, and of joints whose asked position, are those of the whole run, and the number of
    fixed objects and of failures by mode. A joint that either run asks a position of counts."""
    _, before, asked = whole
    scales = assets.merge(before, on="asset_id", suffixes=("", "_whole")).dropna(subset=["scale", "scale_whole"])
    near = np.abs(np.log(scales["scale"] / scales["scale_whole"])) <= np.log(SIZE_FACTOR)
    keys = ["asset_id", "joint"]
    pairs = joints.merge(asked, on=keys, suffixes=("", "_whole"))
    pairs = pairs[pairs["asked_position"].notna() | pairs["asked_position_whole"].notna()]
    span = (pairs["upper"] - pairs["lower"]).abs()
    same = (share_of(pairs, "") - share_of(pairs, "_whole")).abs() <= STATE_SHARE
    modes = assets.loc[assets["status"] != Status.OK.value, "failure_mode"].value_counts()
    return [
        percent(int(near.sum()), len(scales)),
        percent(int(same[span > 0.0].sum()), int((span > 0.0).sum())),
        str(int((assets["support"] == "fixed").sum())),
        ", ".join(f"{mode} {count}" for mode, count in sorted(modes.items())) or NOTHING,
    ]


def share_of(pairs: pd.DataFrame, suffix: str) -> "pd.Series[float]":
    """Where each joint starts, as a share of its range: sizes differ between runs."""
    lower, upper = pairs[f"lower{suffix}"], pairs[f"upper{suffix}"]
    start: pd.Series[float] = (pairs[f"initial_position{suffix}"] - lower) / (upper - lower)
    return start
