"""``asset2sim ratings``: ratings beside our verdicts, object by object, from stored tables and published ones."""

from datetime import UTC, datetime
from pathlib import Path

import pandas as pd
import pytest

from asset2sim.catalog.own_files import OwnFile, read_own_files
from asset2sim.catalog.write import write_run
from asset2sim.viewer.walk import Stop
from flows.command import run_command
from lab.judged.published import published_ratings, table_frame
from lab.judged.rating_plan import Variant, new_keys, plan_for, unrated, variants_of
from lab.judged.show_ratings import RatedVariant, verdict_figures, verdicts_of
from lab.judged.variant_folders import variant_folders
from lab.schemas.tables import RATING_KEYS, RATINGS, VIDEO_SCORES
from schemas.errors import UsageError
from schemas.vocabulary import FailureMode, Method
from tests.assets import SHARED
from tests.factories import MODEL, make_failure, make_record
from tests.test_catalog_history import night

PAPER = SHARED / "paper_tables"


def printed(words: list[str], capsys: pytest.CaptureFixture[str], code: int = 0) -> str:
    def never(request: object) -> object:
        raise AssertionError("no flow must start")

    assert run_command(words, refine=never, nightly=never) == code  # type: ignore[arg-type]
    captured = capsys.readouterr()
    return captured.err if code else captured.out


@pytest.fixture
def compared(tmp_path: Path) -> Path:
    """Two assets by two methods, as a comparison lays them out; ``b`` fails by ours, and was mended in a later run."""
    for method in (Method.ASSET2SIM, Method.DIRECT):
        out = tmp_path / method.value / "prior_household"
        out.mkdir(parents=True)
        b = make_failure("b", FailureMode.JAM, method=method) if method is Method.ASSET2SIM else None
        write_run(out, night(1), [make_record("a", method=method), b or make_record("b", method=method)])
        write_run(out, night(2), [make_record("b", method=method)])
    return tmp_path


def rate(out: Path, rater: str, scores: dict[tuple[str, str], tuple[str, float]], note: str = "") -> None:
    """Ratings by asset and label, each of a method, with their keys: ``a`` and ``b`` as the first night left them."""
    ratings, keys = OwnFile(out, RATINGS), OwnFile(out, RATING_KEYS)
    for place, ((asset_id, label), (method, score)) in enumerate(scores.items()):
        who = {"rater": rater, "asset_id": asset_id, "label": label}
        known = {"method": method, "model": MODEL, "run_id": night(1).run_id, "out": str(out), "seed": 0}
        keys.add([who | known])
        given = {"rated_at": datetime(2026, 11, 3, tzinfo=UTC), "score": score, "note": note, "seconds": 60.0}
        stages = {"score_before": score, "score_untouched": score, "score_touched": None, "seconds_touched": None}
        ratings.add([who | given | stages | {"position": place % 2, "presented": place}])


def test_where_people_and_numbers_disagree_is_listed_object_by_object(
    compared: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert [Path(out).parent.name for out in variant_folders([compared])] == ["asset2sim", "direct"]
    rate(compared, "ann", {("a", "A"): ("direct", 2), ("a", "B"): ("asset2sim", 8), ("b", "A"): ("asset2sim", 9)})
    rate(compared, "bob", {("a", "A"): ("asset2sim", 7), ("a", "B"): ("direct", 3), ("b", "A"): ("asset2sim", 8)}, "ok")
    said = " ".join(printed(["ratings", str(compared)], capsys).split())
    assert "asset2sim 8.00" in said and "2 × 2" in said and "direct 2.50" in said
    # Pairs (2, 3), (8, 7), (9, 8), each 1 apart in square: 1, over that of all thirty ordered pairs.
    values = [2, 3, 8, 7, 9, 8]
    expected = sum((x - y) ** 2 for x in values for y in values) / 30
    assert f"alpha, interval): {1 - 1 / expected:.2f} in all, {1 - 1 / expected:.2f} before" in said
    assert "effect of the order on the rating: -" in said or "effect of the order on the rating: +" in said
    assert "with our verdicts on 3 variants" in said and "passes 5.00, of what fails 8.50" in said
    assert "disagree on 2:" in said, "as the first night left them, whatever the second did"
    assert "a, direct: rated 2.50 by 2 raters, passes every check “ok”" in said
    assert "b, asset2sim: rated 8.50 by 2 raters, fails (jam: bad_file: cannot go on) “ok”" in said


def test_the_rows_of_ratings_alone_name_no_method(compared: Path) -> None:
    rate(compared, "ann", {("a", "A"): ("direct", 2), ("a", "B"): ("asset2sim", 8)})
    (file,) = (compared / "ratings").iterdir()
    stored = file.read_bytes()
    assert not any(method.value.encode() in stored for method in (Method.DIRECT, Method.ASSET2SIM))
    assert "method" not in read_own_files(compared, RATINGS) and "model" not in read_own_files(compared, RATINGS)
    assert read_own_files(compared, VIDEO_SCORES).empty


@pytest.mark.skipif(not PAPER.is_dir(), reason=f"the paper's tables are not in {PAPER}")
def test_the_published_tables_are_printed_beside_our_verdicts(
    compared: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = " ".join(printed(["ratings", str(compared), "--published", str(PAPER)], capsys).split())
    for words in ("asset2sim 7.04 5.89 to 8.02 0.54 1.75", "2.50 ± 0.21", "2.96 ± 0.13", "0.69 in all"):
        assert words in said
    assert "no verdict of ours on what was rated" in said, "other assets"
    ours = [make_record("7236", method=Method.DIRECT), make_failure("7236", FailureMode.JAM, method=Method.IVW)]
    write_run(compared / "direct" / "prior_household", night(3), ours)
    said = " ".join(printed(["ratings", str(compared), "--published", str(PAPER)], capsys).split())
    rating = published_ratings(PAPER)[0].merge(published_ratings(PAPER)[1], on=["rater", "asset_id", "label"])
    mean = rating[(rating["asset_id"] == "7236") & (rating["method"] == "direct")]["score"].mean()
    assert mean < 5.0 and f"7236, direct: rated {mean:.2f} by 5 raters, passes every check" in said
    assert "verdicts on ours of the same assets and methods" in said


def test_what_is_not_rated_or_not_there_says_what_to_do(
    compared: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert "nothing is rated or scored; asset2sim rate OUT opens" in printed(["ratings", str(compared)], capsys, code=2)
    assert "name an output folder, or --published" in printed(["ratings"], capsys, code=2)
    assert "no catalog in it, nor in METHOD/MODEL below it" in printed(
        ["ratings", str(tmp_path / "none")], capsys, code=2
    )
    assert "no refined object of these methods" in printed(["rate", str(compared), "--methods", "agent"], capsys, 2)
    assert "unknown asset 'z'" in printed(["rate", str(compared), "--assets", "a,z"], capsys, 2)
    assert "argument --engine: the viewer runs" in printed(["rate", str(compared), "--engine", "sapien"], capsys, 2)
    (compared / "ratings").write_text("in the way", encoding="utf-8")
    with pytest.raises(UsageError, match="ratings: nothing is stored"):
        OwnFile(compared, RATINGS).add([])


def test_the_correlation_with_verdicts_is_pearson_s() -> None:
    def variant(rating: float, passes: float) -> RatedVariant:
        return RatedVariant("x", "direct", "none", rating, 1, (), passes, "")

    some = [variant(2.0, 0.0), variant(4.0, 0.0), variant(6.0, 1.0), variant(8.0, 1.0)]
    found = verdict_figures(some)
    # Deviations −3, −1, 1, 3 and ∓½: 4 / √(20 · 1).
    assert found.r == pytest.approx(4.0 / 20.0**0.5) and (found.of_passes, found.of_failures) == (7.0, 3.0)
    assert verdict_figures(some[:2]).r != verdict_figures(some[:2]).r
    assert [item.disagrees for item in some] == [False] * 4 and variant(5.0, 0.0).disagrees


def test_verdicts_are_of_every_run(compared: Path) -> None:
    found = verdicts_of(variant_folders([compared]))
    ours = found[(found["method"] == "asset2sim") & (found["asset_id"] == "b")]
    assert sorted(ours[["run_id", "status", "latest"]].itertuples(index=False, name=None)) == [
        (night(1).run_id, "failed", False), (night(2).run_id, "ok", True),
    ]  # fmt: skip


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
