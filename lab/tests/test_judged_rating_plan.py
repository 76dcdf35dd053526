"""The order in which a rater is shown variants: shuffled, seeded, one's own, and the same when one comes back."""

from pathlib import Path

import pandas as pd
import pytest

from asset2sim.catalog.write import write_run
from asset2sim.viewer.walk import Stop
from lab.judged.published import table_frame
from lab.judged.rating_plan import Variant, new_keys, plan_for, unrated, variants_of
from lab.schemas.tables import RATING_KEYS, RATINGS
from schemas.errors import UsageError
from schemas.vocabulary import FailureMode, Method
from tests.factories import make_failure, make_record
from tests.test_catalog_history import night

NO_KEYS = table_frame(RATING_KEYS, [])


def variant(asset_id: str, method: str, run_id: str = "r") -> Variant:
    stop = Stop(asset_id, method, "m", run_id, "Box", False, "none", "", "a box", f"assets/{asset_id}", "raw", False)
    return Variant(Path(method), stop)


EVERY = [variant(asset, method) for asset in "xyz" for method in ("direct", "ivw", "reference", "asset2sim")]


def orders(rater: str, seed: int = 0) -> list[tuple[str, str]]:
    return [(item.asset_id, item.variant.stop.method) for item in plan_for(rater, EVERY, NO_KEYS, seed).shown]


def test_each_rater_has_an_order_of_their_own_and_always_the_same() -> None:
    assert orders("ann") == orders("ann") != orders("bob") and orders("ann") != orders("ann", seed=1)
    plan = plan_for("ann", list(reversed(EVERY)), NO_KEYS, 0)
    assert [(item.asset_id, item.variant.stop.method) for item in plan.shown] == orders("ann"), "whatever came first"
    assert [item.presented for item in plan.shown] == list(range(12))
    assert [(item.label, item.position) for item in plan.shown] == [("A", 0), ("B", 1), ("C", 2), ("D", 3)] * 3
    assert len({item.asset_id for item in plan.shown[:4]}) == 1, "all variants of an object in a row"
    firsts = [orders(f"rater {number}")[0][1] for number in range(400)]
    counts = pd.Series(firsts).value_counts()
    assert len(counts) == 4 and counts.min() > 60, "of four methods, each is first a hundred times in the mean"


def test_a_label_stays_when_variants_come_and_go() -> None:
    before = plan_for("ann", EVERY, NO_KEYS, 7)
    keys = table_frame(RATING_KEYS, before.key_rows())
    again = plan_for("ann", EVERY, keys, 0)
    assert again == before and new_keys(again, keys) == []
    label = {item.variant.identity: item.label for item in before.shown}
    changed = [variant("x", "direct", "later"), *(item for item in EVERY if item != variant("x", "direct"))]
    after = plan_for("ann", changed, keys, 0)
    now = {item.variant.identity: item.label for item in after.shown}
    assert now.pop(changed[0].identity) == "E", "refined again, it is another variant"
    assert now.items() <= label.items() and len(new_keys(after, keys)) == 1
    done = before.shown[:5]
    some = {"score_before": None, "score_untouched": None, "score_touched": None, "seconds": None}
    rated = [
        {"rater": "ann", "asset_id": item.asset_id, "label": item.label, "score": 1.0, "rated_at": None}
        | {"note": "", "seconds_touched": None, "position": None, "presented": None} | some
        for item in done
    ]  # fmt: skip
    ratings = table_frame(RATINGS, rated)
    assert unrated(again, ratings) == list(before.shown[5:])
    assert len(unrated(plan_for("bob", EVERY, keys, 0), ratings)) == 12


def test_what_there_is_to_rate_is_chosen_by_method_and_asset(tmp_path: Path) -> None:
    folders = []
    for method in (Method.ASSET2SIM, Method.DIRECT):
        folders.append(tmp_path / method.value)
        folders[-1].mkdir()
        lost = make_failure("c", FailureMode.MISSING_MESH, method=method)
        write_run(folders[-1], night(1), [make_record("a", method=method), make_record("b", method=method), lost])
    there, missing = variants_of(folders, (), ())
    assert len(there) == 4 and [item.stop.asset_id for item in missing] == ["c", "c"]
    there, _ = variants_of(folders, (Method.DIRECT,), ("b",))
    assert [item.identity[:2] for item in there] == [("b", "direct")]
    with pytest.raises(UsageError, match="unknown asset 'd'"):
        variants_of(folders, (), ("d",))
    with pytest.raises(UsageError, match="no refined object of these methods"):
        variants_of(folders, (Method.AGENT,), ())
