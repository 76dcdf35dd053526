"""The paper's published ratings, video scores and success rates, from a folder of its tables, as our own tables."""

from pathlib import Path

import pandas as pd
import pyarrow as pa

from asset2sim.catalog.enforce import to_arrow
from lab.schemas.tables import RATING_KEYS, RATINGS, VIDEO_SCORES
from schemas.errors import UsageError
from schemas.table import Row, Table
from schemas.vocabulary import Method

RATINGS_FILE, VIDEOS_FILE = "human_ratings.csv", "video_judges.csv"
SUCCESS_FILE, LEARNING_FILE = "policy_success.csv", "learning_success.csv"
NO_MODEL = "none"
PUBLISHED_TRIALS = 10
"""Trials per task, judge and method behind a published mean."""
PUBLISHED_EPISODES = 5
"""Trials per task, policy and method behind a published success rate."""
METHODS = {"human": Method.REFERENCE.value}
"""The paper's name of a method → ours, where they differ."""


def published_ratings(folder: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The tables ``ratings`` and ``rating_keys`` of ``human_ratings.csv``. Labels are given in the file's order; what
    the paper does not state is null. Raises UsageError for a file that is missing or lacks a column."""
    found = _read(folder, RATINGS_FILE, ("object", "asset_id", "rater", "method", "score"))
    shown = found.groupby(["rater", "asset_id"]).cumcount()
    ratings: list[Row] = []
    keys: list[Row] = []
    for row, place in zip(found.to_dict("records"), shown, strict=True):
        who: Row = {"rater": str(row["rater"]), "asset_id": str(row["asset_id"]), "label": label_of(int(place))}
        ratings.append(dict.fromkeys(RATINGS.schema.names) | who | {"score": float(row["score"]), "note": ""})
        who |= {"method": our_name(row["method"]), "model": NO_MODEL}
        keys.append(dict.fromkeys(RATING_KEYS.schema.names) | who)
    return table_frame(RATINGS, ratings), table_frame(RATING_KEYS, keys)


def published_videos(folder: Path) -> pd.DataFrame:
    """The table ``video_scores`` of ``video_judges.csv``: a row stands for the trials of a task, judge and method. The
    assets of the tasks are those of ``human_ratings.csv``. Raises UsageError as ``published_ratings``."""
    found = _read(folder, VIDEOS_FILE, ("task", "judge", "method", "mean_score", "standard_deviation"))
    objects = _read(folder, RATINGS_FILE, ("object", "asset_id"))
    assets = dict(zip(objects["object"].astype(str), objects["asset_id"].astype(str), strict=True))
    rows: list[Row] = []
    for row in found.to_dict("records"):
        name = str(row["task"]).split()[0]
        if name not in assets:
            raise UsageError(f"{folder / VIDEOS_FILE}: task '{row['task']}': no object '{name}' in {RATINGS_FILE}")
        rows.append(
            dict.fromkeys(VIDEO_SCORES.schema.names)
            | {"task": row["task"], "asset_id": assets[name], "judge": row["judge"], "trial": 0}
            | {"trials": PUBLISHED_TRIALS, "method": our_name(row["method"]), "model": NO_MODEL}
            | {"score": float(row["mean_score"]), "score_deviation": float(row["standard_deviation"])}
        )
    return table_frame(VIDEO_SCORES, rows)


def published_rates(folder: Path) -> pd.DataFrame:
    """Success rates of ``policy_success.csv``, 0 to 1, by policy, method, model and task, in the form of ``rates_of``;
    the method ``real`` is reality. Raises UsageError as ``published_ratings``."""
    found = _read(folder, SUCCESS_FILE, ("task", "policy", "method", "success_percent"))
    rates = found["success_percent"].astype(float) / 100.0
    method = found["method"].map(our_name)
    some = found[["policy", "task"]].astype(str)
    return some.assign(method=method, model=NO_MODEL, rate=rates, trials=PUBLISHED_EPISODES)


def published_learning(folder: Path) -> pd.DataFrame:
    """``learning_success.csv``: what share of its rollouts (``success_percent``) a policy of the paper's did, by task,
    ``asset_id`` and our name of the method. Raises UsageError as ``published_ratings``."""
    found = _read(folder, LEARNING_FILE, ("task", "asset_id", "method", "success_percent"))
    return found.assign(asset_id=found["asset_id"].astype(str), method=found["method"].map(our_name))


def label_of(place: int) -> str:
    """The blinded label of the variant at a place, 0 first: A to Z, then A1, B1, …"""
    turn, letter = divmod(place, 26)
    return chr(ord("A") + letter) + (str(turn) if turn else "")


def our_name(method: object) -> str:
    """Our name of a method that the paper names."""
    return METHODS.get(str(method), str(method))


def table_frame(table: Table, rows: list[Row]) -> pd.DataFrame:
    """Rows as the data frame that reading the table gives. Raises CatalogError for rows that do not fit."""
    frame: pd.DataFrame = to_arrow(table, rows).to_pandas(types_mapper={pa.int64(): pd.Int64Dtype()}.get)
    return frame


def _read(folder: Path, name: str, columns: tuple[str, ...]) -> pd.DataFrame:
    try:
        found = pd.read_csv(folder / name)
    except (OSError, ValueError) as error:  # pandas' own errors are ValueErrors
        raise UsageError(f"{folder / name} cannot be read ({error}); --published names the paper's tables") from error
    lost = [column for column in columns if column not in found.columns]
    if lost:
        raise UsageError(f"{folder / name}: no column '{lost[0]}'; it has {', '.join(map(str, found.columns))}")
    return found
