"""Figures of ratings and of video scores: the paper's, from its published tables, and cases worked by hand."""

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from lab.judged.figures import (
    joined,
    krippendorff_alpha,
    order_effect,
    rater_matrix,
    rating_figures,
    task_score,
    video_figures,
)
from lab.judged.published import label_of, published_ratings, published_videos
from lab.schemas.tables import RATING_KEYS, RATINGS, VIDEO_SCORES
from schemas.errors import UsageError
from tests.assets import SHARED

PAPER = SHARED / "paper_tables"
published = pytest.mark.skipif(not PAPER.is_dir(), reason=f"the paper's tables are not in {PAPER}")
NO = math.nan


@published
def test_the_published_means_of_both_judges_come_out_to_their_last_digit() -> None:
    scores = published_videos(PAPER)
    assert list(scores.columns) == VIDEO_SCORES.schema.names and len(scores) == 88
    found = {(item.judge, item.method): item for item in video_figures(scores)}
    said = {key: f"{item.mean:.2f} ± {item.plus_minus:.2f}" for key, item in found.items()}
    assert said["Gemini 3.0", "asset2sim"] == "2.50 ± 0.21" and said["Qwen3-VL 32B", "asset2sim"] == "2.96 ± 0.13"
    others = {key: item.mean for key, item in found.items() if key[1] != "asset2sim"}
    assert f"{max(others.values()):.2f}" == "2.43", "at most, of any other method"
    best = found["Gemini 3.0", "asset2sim"]
    assert (best.tasks, best.trials) == (11, 110) and best.low < best.mean - best.plus_minus < best.mean < best.high


@published
def test_the_published_ratings_come_out_to_their_last_digit() -> None:
    ratings, keys = published_ratings(PAPER)
    assert list(ratings.columns) == RATINGS.schema.names and list(keys.columns) == RATING_KEYS.schema.names
    assert not {"asset2sim", "direct", "ivw", "human", "reference"} & set(ratings.astype(str).to_numpy().ravel())
    rated = joined(ratings, keys)
    found = {item.method: item for item in rating_figures(rated)}
    assert {name: f"{item.mean:.2f}" for name, item in found.items()} == {
        "asset2sim": "7.04", "ivw": "3.98", "direct": "2.82", "reference": "2.18"
    }  # fmt: skip
    order = ("asset2sim", "reference", "ivw", "direct")
    assert [f"{found[name].over_raters:.2f}" for name in order] == ["0.54", "0.91", "0.71", "1.25"]
    assert [f"{found[name].over_objects:.2f}" for name in order] == ["1.75", "0.71", "2.77", "0.94"]
    assert all((item.raters, item.objects) == (5, 9) for item in found.values())
    assert 0.6 < krippendorff_alpha(rater_matrix(rated)) < 0.75


def test_a_file_of_the_paper_that_is_not_one_says_what_it_lacks(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"human_ratings\.csv cannot be read"):
        published_ratings(tmp_path)
    (tmp_path / "human_ratings.csv").write_text("object,asset_id,rater,method\nbox,1,1,ivw\n", encoding="utf-8")
    with pytest.raises(UsageError, match="no column 'score'; it has object, asset_id, rater, method"):
        published_ratings(tmp_path)


def test_alpha_is_krippendorff_s_own_and_one_by_hand() -> None:
    """Krippendorff (2011), Computing Krippendorff's Alpha-Reliability: four observers, twelve units, 0.849."""
    observers = np.array(
        [
            [1, 2, 3, 3, 2, 1, 4, 1, 2, NO, NO, NO],
            [1, 2, 3, 3, 2, 2, 4, 1, 2, 5, NO, 3],
            [NO, 3, 3, 3, 2, 3, 4, 2, 2, 5, 1, NO],
            [1, 2, 3, 3, 2, 4, 4, 1, 2, 5, 1, NO],
        ]
    )
    assert f"{krippendorff_alpha(observers):.3f}" == "0.849"
    # Units (0, 2) and (4, 4): observed (2·4 + 0) / 4 = 2; all six pairs of 0, 2, 4, 4 differ by 4, 16, 16, 4, 4, 0 in
    # square, so expected 2·44 / (4·3) = 22/3; alpha = 1 − 6/22.
    assert krippendorff_alpha(np.array([[0.0, 4.0], [2.0, 4.0]])) == pytest.approx(1.0 - 6.0 / 22.0)
    assert krippendorff_alpha(np.array([[0.0, 4.0], [0.0, 4.0]])) == 1.0
    assert krippendorff_alpha(np.array([[4.0, 0.0], [0.0, 4.0]])) == pytest.approx(-0.5)
    for nothing in (np.array([[3.0, 3.0], [3.0, 3.0]]), np.array([[1.0, NO], [NO, 2.0]])):
        assert math.isnan(krippendorff_alpha(nothing))


def test_rows_of_single_trials_and_of_their_summary_are_the_same() -> None:
    single = pd.DataFrame({"trials": 1, "score": [1.0, 2.0, 4.5, 3.0], "score_deviation": NO})
    mean, spread = task_score(single)
    values = np.array([1.0, 2.0, 4.5, 3.0])
    assert (mean, spread) == pytest.approx((2.625, values.std(ddof=1)))
    halves = pd.DataFrame(
        {"trials": 2, "score": [1.5, 3.75], "score_deviation": [values[:2].std(ddof=1), values[2:].std(ddof=1)]}
    )
    assert task_score(halves) == pytest.approx((mean, spread))
    assert math.isnan(task_score(single[:1])[1])


def rated_in_order(effect: float, raters: int = 4, seed: int = 0) -> pd.DataFrame:
    """Four variants of each of three objects, shuffled; each place later adds ``effect``."""
    rng = np.random.default_rng(seed)
    worth = {(asset, method): rng.normal(5.0, 2.0) for asset in "xyz" for method in "abcd"}
    return pd.DataFrame(
        [
            {
                "rater": rater, "asset_id": asset, "method": method, "position": place,
                "score": worth[asset, method] + effect * place + rng.normal(0.0, 0.1),
            }
            for rater in range(raters) for asset in "xyz" for place, method in enumerate(rng.permutation(list("abcd")))
        ]
    )  # fmt: skip


def test_an_effect_of_the_order_is_found_where_there_is_one() -> None:
    blocks, items = ["rater", "asset_id"], ["asset_id", "method"]
    for effect in (0.0, -0.5):
        found = order_effect(rated_in_order(effect), blocks, items)
        assert found is not None and found.n == 48 and found.slope == pytest.approx(effect, abs=0.05)
        assert (found.p < 0.01) == (effect != 0.0)
    assert order_effect(rated_in_order(-0.5, raters=1), blocks, items) is None, "each variant had one place only"
    unknown = rated_in_order(0.0).assign(position=pd.array([None] * 48, dtype="Int64"))
    assert order_effect(unknown, blocks, items) is None


def test_a_rating_counts_once_and_only_with_its_key() -> None:
    ratings = pd.DataFrame(
        {
            "rater": ["ann", "ann"], "asset_id": "x", "label": "A", "score": [2.0, 8.0],
            "rated_at": pd.to_datetime(["2026-11-02T10:00Z", "2026-11-02T09:00Z"]),
        }
    )  # fmt: skip
    keys = pd.DataFrame({"rater": ["ann"], "asset_id": "x", "label": "A", "method": "direct", "model": "none"})
    assert joined(ratings, keys)["score"].tolist() == [2.0]
    with pytest.raises(UsageError, match="1 ratings have no key, as that of asset x, variant A, by ann"):
        joined(ratings, keys.assign(label="B"))
    assert [label_of(place) for place in (0, 25, 26)] == ["A", "Z", "A1"]
