"""Judges of videos: orders drawn by lot, what a judge is sent over HTTP, scores that find their way back, and failures.

The films are squares that move, of a colour for each method: whoever decodes the frames knows which is which.
"""

import base64
import io
import json
import math
import re
import shutil
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from asset2sim.catalog.own_files import OwnFile, read_own_files
from asset2sim.catalog.write import write_run
from asset2sim.runs.options import parse
from asset2sim.runs.request import settings_for_run, stated_settings
from flows.command import run_command
from lab.judged.figures import latest_scores, mean_by_place, order_effect, video_figures
from lab.judged.judge_videos import judge_videos
from lab.judged.physical_scores import PHYSICAL_JUDGE
from lab.judged.video_candidates import Candidate, TaskComparison, shuffled, trial_seeds
from lab.judged.video_frames import UnreadableFilmError, sampled_frames
from lab.judged.video_judge import judge_settings
from lab.judged.video_prompt import parse_video_answer
from lab.options import JudgeVideosOptions
from lab.schemas.tables import TRIALS, VIDEO_SCORES
from lab.trials.study import motion_folder
from schemas.errors import InvalidAnswerError, UsageError
from schemas.settings import ModelSettings
from schemas.table import Row
from schemas.vocabulary import Method
from tests.factories import MODEL, make_record
from tests.model_server import Reply, forget_refusals, serve
from tests.test_catalog_history import night

av = pytest.importorskip("av")

COLOURS = {
    Method.REFERENCE: (220, 30, 30), Method.IVW: (30, 200, 30), Method.DIRECT: (40, 40, 230),
    Method.ASSET2SIM: (230, 220, 20),
}  # fmt: skip
SCORES = {Method.REFERENCE: 1.5, Method.IVW: 2.0, Method.DIRECT: 3.5, Method.ASSET2SIM: 5.0}
TASK, ASSET = "trashcan close", "102181"
STILL, MOVING, SIDE = 8, 12, 64


def write_film(to: Path, method: Method) -> None:
    """A square that waits, moves to the right and waits again, in the method's colour; its metadata gives it away."""
    to.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(to), "w") as container:
        container.metadata["title"] = f"{method.value} of {to}"
        container.metadata["comment"] = method.value
        stream = container.add_stream("libx264", rate=15, options={"crf": "10"})
        stream.width = stream.height = SIDE
        stream.pix_fmt = "yuv420p"
        for at in [0] * STILL + list(range(0, 3 * MOVING, 3)) + [3 * MOVING] * STILL:
            picture = np.full((SIDE, SIDE, 3), 128, np.uint8)
            picture[20:44, at : at + 24] = COLOURS[method]
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())


def trial_row(method: Method, **changes: object) -> Row:
    row: Row = {
        "task": TASK, "asset_id": ASSET, "method": method.value, "model": MODEL, "run_id": night(1).run_id,
        "verb": "close", "outcome": "done", "reason": "", "score": 5.0, "first_contact_s": 1.2, "force_n": 8.0,
        "moved_rad": 0.3, "moved_m": 0.0, "recorded_at": datetime(2026, 11, 2, tzinfo=UTC),
    }  # fmt: skip
    faults = dict.fromkeys(("moved_before_contact", "energy_appeared", "jumped", "overlapped", "rang"), False)
    return dict.fromkeys(TRIALS.schema.names) | row | faults | changes


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a comparison, in which each method has a film of the same task."""
    folder = tmp_path_factory.mktemp("made")
    for method in COLOURS:
        out = folder / method.value / "prior_household"
        out.mkdir(parents=True)
        write_run(out, night(1), [make_record(ASSET, method=method)])
        write_film(motion_folder(out, ASSET, TASK) / "motion.mp4", method)
        OwnFile(out, TRIALS).add([trial_row(method)])
    return folder


@pytest.fixture
def compared(made: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return Path(shutil.copytree(made, tmp_path, dirs_exist_ok=True))


def pictures(body: Mapping[str, Any]) -> list[list[bytes]]:
    """The frames of each candidate of a request, as files."""
    found: dict[str, list[bytes]] = {}
    label = ""
    for part in body["messages"][1]["content"][1:]:
        if part["type"] == "text":
            label = part["text"].split(",")[0]
        else:
            found.setdefault(label, []).append(base64.b64decode(part["image_url"]["url"].split(",", 1)[1]))
    assert list(found) == [f"Image: candidate {place}" for place in range(1, len(found) + 1)]
    return list(found.values())


def seen(png: bytes) -> Method:
    """The method whose colour a frame shows."""
    pixels = np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).reshape(-1, 3).astype(int)
    colour = pixels[np.ptp(pixels, axis=1).argmax()]
    return min(COLOURS, key=lambda method: float(np.abs(colour - COLOURS[method]).sum()))


def said(scores: Sequence[float]) -> str:
    words = {"description": "it moves", "pros": "smooth", "cons": ""}
    return json.dumps({"candidates": [{"index": i, **words, "score": score} for i, score in enumerate(scores, 1)]})


def honest(body: dict[str, Any]) -> Reply:
    """A judge that looks at the frames, and scores each candidate by its colour."""
    return Reply(said([SCORES[seen(frames[0])] for frames in pictures(body)]))


def run(
    out: Path, api_base: str | None, told: Callable[[str], None] = print,
    judges: Sequence[str] = ("hosted_vllm/judge",), trials: int = 3, seed: int = 0, record: Path | None = None,
    real: Path | None = None, **settings: object,
) -> pd.DataFrame:  # fmt: skip
    model = ModelSettings.model_validate({"api_base": api_base, "max_attempts": 1} | settings)
    return judge_videos([out], judges, trials, 5, seed, model, told, record, real)


def comparison(count: int, asset_id: str = ASSET) -> TaskComparison:
    items = tuple(Candidate(f"m{number}", "x", None, Path("film.mp4")) for number in range(count))
    return TaskComparison(TASK, asset_id, "close", items, ())


# Orders and frames


def test_no_order_comes_twice_before_every_other_and_the_seed_gives_it_again() -> None:
    for count, trials in ((4, 24), (3, 6), (2, 2)):
        orders = [shuffled(seed, count) for seed in trial_seeds(comparison(count), trials, 0)]
        assert len(set(orders)) == trials == math.factorial(count)
    assert len({shuffled(seed, 2) for seed in trial_seeds(comparison(2), 10, 0)}) == 2
    seeds = trial_seeds(comparison(4), 10, 0)
    assert seeds == trial_seeds(comparison(4), 12, 0)[:10] and all(0 < seed < 2**31 for seed in seeds)
    others = (
        trial_seeds(comparison(4), 10, 1),
        trial_seeds(comparison(4, "9912"), 10, 0),
        trial_seeds(comparison(3), 10, 0),
    )
    assert not any(set(seeds) & set(other) for other in others), "another run, object or set of candidates"
    assert len(trial_seeds(comparison(1), 3, 0)) == len(set(trial_seeds(comparison(1), 3, 0))) == 3


@pytest.mark.parametrize("method", [Method.DIRECT, Method.IVW])
def test_frames_are_spread_over_what_moves_with_their_times(method: Method, tmp_path: Path) -> None:
    """The second is a square as light as what is behind it."""
    film = tmp_path / "direct.mp4"
    write_film(film, method)
    frames = sampled_frames(film, 6, 512)
    times = [frame.time_s for frame in frames]
    last = (2 * STILL + MOVING - 1) / 15
    assert times[0] == 0.0 and times[-1] == pytest.approx(last, abs=1e-3)
    assert all(STILL / 15 <= time <= (STILL + MOVING) / 15 + 1e-3 for time in times[1:-1]), "none while it waits"
    assert np.ptp(np.diff(times[1:-1])) < 0.08 and all(
        frame.length_s == pytest.approx(last, abs=1e-3) for frame in frames
    )
    assert frames == sampled_frames(film, 6, 512), "the same bytes, which the cache needs"
    for frame in frames:
        picture = Image.open(io.BytesIO(frame.png))
        assert (picture.format, picture.size, picture.info) == ("PNG", (SIDE, SIDE), {}) and not picture.getexif()
    assert Image.open(io.BytesIO(sampled_frames(film, 2, 32)[1].png)).size == (32, 32)
    assert len(sampled_frames(film, 500, 512)) == 2 * STILL + MOVING
    film.write_bytes(film.read_bytes()[:200])
    with pytest.raises(UnreadableFilmError, match=r"direct\.mp4 cannot be read"):
        sampled_frames(film, 6, 512)


def test_an_answer_has_every_candidate_once_and_scores_in_halves() -> None:
    assert [item.score for item in parse_video_answer(said([0, 4.5, 5]), 3)] == [0, 4.5, 5]
    for text, message in (
        (said([1, 2]), "indices are 1, 2; 1 to 3 are wanted"),
        (said([1, 2, 4.25]), "a half"),
        (said([1, 2, 5.5]), "less than or equal to 5"),
        (said([1, 2, 3]).replace('"pros": "smooth", ', "", 1), "pros"),
        ("I cannot see any pictures.", "JSON"),
    ):
        with pytest.raises(InvalidAnswerError, match=message):
            parse_video_answer(text, 3)


# What a judge is sent


@pytest.mark.system
def test_a_judge_gets_frames_that_it_can_score_in_shuffled_order(compared: Path) -> None:
    with serve(honest) as server:
        rows = run(compared, server.api_base, trials=6)
    assert len(server.requests) == 6 and len(rows) == 24 and rows["judge"].unique().tolist() == ["hosted_vllm/judge"]
    shown = {body["seed"]: [seen(frames[-1]).value for frames in pictures(body)] for body in server.requests}
    assert len({tuple(order) for order in shown.values()}) == 6
    by_name = sorted(method.value for method in COLOURS)
    for seed, order in shown.items():
        ordered = rows[rows["seed"] == seed].sort_values("position")
        assert ordered["method"].tolist() == order == [by_name[index] for index in shuffled(seed, 4)]
    right = [SCORES[Method(name)] for name in rows["method"]]
    assert rows["score"].tolist() == right, "each score found its method"
    assert (rows["candidates"] == 4).all() and (rows["frames"] == 5).all() and (rows["temperature"] == 0.0).all()
    for body in server.requests:
        for frames in pictures(body):
            assert len(frames) == 5 and len({Image.open(io.BytesIO(png)).tobytes() for png in frames[:4]}) == 4
        labels = [part["text"] for part in body["messages"][1]["content"][1:] if part["type"] == "text"]
        assert labels[0] == "Image: candidate 1, 0.00 s of 1.80 s" and len(labels) == 20
        told = "the following motion prompt: 'The robot tries to close the trashcan lid.'"
        assert body["messages"][1]["content"][0]["text"].startswith(f"You are shown candidate videos for {told}\n")
    stored = read_own_files(compared, VIDEO_SCORES)
    assert len(stored) == 24 and stored["description"].unique().tolist() == ["it moves"]


@pytest.mark.system
def test_a_film_of_reality_comes_first_and_the_others_in_shuffled_order(compared: Path, tmp_path: Path) -> None:
    reality = tmp_path / "reality"
    write_film(reality / "trashcan-close.mp4", Method.ASSET2SIM)
    shutil.rmtree(compared / Method.ASSET2SIM.value)
    with serve(honest) as server:
        rows = run(compared, server.api_base, trials=6, real=reality)
    orders = [tuple(seen(frames[-1]) for frames in pictures(body)) for body in server.requests]
    assert all(order[0] is Method.ASSET2SIM for order in orders) and len(set(orders)) == 6 == math.factorial(3)
    real = rows[rows["position"] == 0]
    assert set(zip(real["method"], real["model"], real["score"], strict=True)) == {("real", "none", 5.0)}
    assert "real" in {figure.method for figure in video_figures(rows)}
    with pytest.raises(UsageError, match=r"no film of a task .* trashcan-close\.mp4"):
        run(compared, None, real=tmp_path)


@pytest.mark.system
def test_nothing_that_is_sent_reveals_a_method(compared: Path) -> None:
    with serve(honest) as server:
        run(compared, server.api_base, trials=2)
    words = {
        *(method.value for method in Method), MODEL, "household", night(1).run_id, str(compared), compared.name,
        "motion.mp4", "motions",
    }  # fmt: skip
    sent = [json.dumps(headers).replace("User-Agent", "") for headers in server.headers]
    for body in server.requests:
        assert {part["type"] for part in body["messages"][1]["content"]} == {"text", "image_url"}
        text = json.dumps(body)
        for frames in pictures(body):
            for png in frames:
                assert set(png_chunks(png)) == {"IHDR", "IDAT", "IEND"}, "pixels, and no words"
                text = text.replace(base64.b64encode(png).decode(), "")
        sent.append(text)
    assert len(sent) == 4 and all(len(text) < 12_000 for text in sent)
    found = [(word, text) for word in words for text in sent if re.search(rf"\b{re.escape(word)}", text, re.IGNORECASE)]
    assert found == []
    film = motion_folder(compared / "direct" / "prior_household", ASSET, TASK) / "motion.mp4"
    assert b"direct" in film.read_bytes(), "the film itself would have told"


def png_chunks(png: bytes) -> list[str]:
    at, found = 8, []
    while at < len(png):
        found.append(png[at + 4 : at + 8].decode())
        at += 12 + int.from_bytes(png[at : at + 4], "big")
    return found


# What goes wrong


@pytest.mark.system
def test_a_wrong_answer_is_asked_again_once_and_then_is_a_row_without_score(
    compared: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[str] = []

    def hasty(body: dict[str, Any]) -> Reply:
        again = "<validation_errors>" in body["messages"][1]["content"][0]["text"]
        asked.append("again" if again else "first")
        return honest(body) if again else Reply(said([1.0]))

    with serve(hasty) as server:
        rows = run(compared, server.api_base, trials=1)
    assert asked == ["first", "again"] and rows["score"].notna().all() and rows["reason"].isna().all()
    with serve([Reply("The second looks best.")]) as server:
        rows = run(compared, server.api_base, trials=2, seed=1)
    assert len(server.requests) == 4 and len(rows) == 8 and rows["score"].isna().all()
    assert rows["reason"].str.contains("answered 2 times and no answer fits").all()
    assert video_figures(rows) == []
    assert printed(["ratings", str(compared)], capsys).count("2 trials without a score: it answered 2 times") == 1


@pytest.mark.system
def test_a_judge_that_sees_no_frames_or_fails_gives_no_score(compared: Path) -> None:
    forget_refusals()

    def blind(body: dict[str, Any]) -> Reply:
        return Reply("this model does not support images", 400) if "image_url" in str(body) else Reply(said([3.0] * 4))

    with serve(blind) as server:
        rows = run(compared, server.api_base, trials=1)
    forget_refusals()
    assert rows["score"].isna().all() and rows["reason"].str.startswith("it was not shown the frames").all()
    with serve([Reply("broken", 500)]) as server:
        rows = run(compared, server.api_base, trials=1, seed=1)
    assert rows["score"].isna().all() and rows["reason"].str.contains("hosted_vllm/judge").all()


@pytest.mark.system
def test_a_spent_budget_ends_the_asking_and_keeps_what_there_is(compared: Path) -> None:
    with serve(honest) as server:
        rows = run(compared, server.api_base, trials=5, run_calls=2)
    assert len(server.requests) == 2 and len(rows) == 20
    assert rows["score"].notna().sum() == 8
    assert rows.loc[rows["score"].isna(), "reason"].str.contains("the run's budget of 2 model calls is spent").all()
    assert {figure.trials for figure in video_figures(rows)} == {2}


@pytest.mark.system
def test_the_cache_answers_the_same_order_only_and_the_latest_look_counts(compared: Path) -> None:
    with serve(honest) as server:
        first = run(compared, server.api_base)
        second = run(compared, server.api_base)
        assert len(server.requests) == 3, "no call for an order that was asked before"
        key = ["trial", "method", "seed", "score", "position"]
        assert first[key].sort_values(key[:2]).values.tolist() == second[key].sort_values(key[:2]).values.tolist()
        run(compared, server.api_base, trials=4, seed=7)
        assert len(server.requests) == 7
    stored = read_own_files(compared, VIDEO_SCORES)
    assert len(stored) == 12 + 12 + 16 and len(latest_scores(stored)) == 16


@pytest.mark.system
def test_a_recorded_judge_gives_its_answers_again_to_the_same_orders(
    compared: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("answers")
    with serve(honest) as server:
        before = run(compared, server.api_base, record=folder, cache=False)
    judge = f"recorded/{folder / 'hosted_vllm_judge'}"
    again = run(compared, None, judges=(judge,))
    key = ["trial", "method", "seed", "score", "position"]
    assert again[key].sort_values(key[:2]).values.tolist() == before[key].sort_values(key[:2]).values.tolist()
    assert again["judge"].unique().tolist() == [judge] and again["temperature"].isna().all()
    other = run(compared, None, judges=(judge,), seed=1)
    assert other["score"].isna().all() and other["reason"].str.contains("no answer is recorded to question 1").all()


@pytest.mark.system
def test_several_judges_are_asked_at_once_about_the_same_orders(compared: Path) -> None:
    with serve(honest) as server:
        judges = ("hosted_vllm/one", "hosted_vllm/two", PHYSICAL_JUDGE)
        rows = run(compared, server.api_base, judges=judges, trials=2)
    assert sorted(body["model"] for body in server.requests) == ["one", "one", "two", "two"]
    orders = {judge: some.sort_values("trial")["seed"].unique().tolist() for judge, some in rows.groupby("judge")}
    assert orders["hosted_vllm/one"] == orders["hosted_vllm/two"] and len(rows) == 4 + 2 * 2 * 4
    assert {figure.judge for figure in video_figures(rows)} == set(judges)


@pytest.mark.system
def test_a_judge_that_likes_the_first_place_is_found_out(compared: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def partial_to_the_first(body: dict[str, Any]) -> Reply:
        scores = [SCORES[seen(frames[0])] for frames in pictures(body)]
        return Reply(said([min(5.0, score + (1.0, 0.5, 0.0, 0.0)[place]) for place, score in enumerate(scores)]))

    words = ["judge-videos", str(compared), "--trials", "10", "--frames", "2", "--judges", "hosted_vllm/judge"]
    with serve(partial_to_the_first) as server:
        told = printed([*words, "--api-base", server.api_base], capsys)
    rows = read_own_files(compared, VIDEO_SCORES)
    effect = order_effect(rows, ["trial"], ["method"])
    assert effect is not None and effect.p < 0.01 and -0.4 < effect.slope < -0.1
    places = ", ".join(f"{mean:.2f}" for mean in mean_by_place(rows))
    assert f"{effect.slope:+.2f} a place (permutation p = {effect.p:.2g}, n = 40)" in told
    assert f"mean by place, the first first: {places}" in told
    assert "10 trials of hosted_vllm/judge, 2 frames each, temperature 0" in told
    assert "trashcan close of 102181: 4 of 4 variants have a film" in told
    with serve(honest) as server:
        honest_rows = run(compared, server.api_base, trials=10, seed=3)
    fair = order_effect(honest_rows, ["trial"], ["method"])
    assert fair is not None and abs(fair.slope) < 1e-9


# The judge that needs no model, and what is not there


def printed(words: list[str], capsys: pytest.CaptureFixture[str], code: int = 0) -> str:
    def never(request: object) -> object:
        raise AssertionError("no refinement must start")

    assert run_command(words, refine=never, nightly=never) == code  # type: ignore[arg-type]
    captured = capsys.readouterr()
    return " ".join((captured.err if code else captured.out).split())


@pytest.mark.system
def test_without_a_model_the_score_is_that_of_the_physical_judge(
    compared: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    direct = compared / "direct" / "prior_household"
    early = trial_row(
        Method.DIRECT, score=1.5, outcome="not done", reason="lid ended at 0.4, not 0", moved_before_contact=True,
        recorded_at=datetime(2026, 11, 3, tzinfo=UTC),
    )  # fmt: skip
    OwnFile(direct, TRIALS).add([early])
    failed = trial_row(
        Method.IVW, score=None, outcome="failed", reason="MuJoCo refuses it", recorded_at=early["recorded_at"]
    )
    OwnFile(compared / "ivw" / "prior_household", TRIALS).add([failed])
    told = printed(["judge-videos", str(compared)], capsys)
    assert f"{PHYSICAL_JUDGE}: 3 of 4 recorded trials have a score" in told
    assert "a formula over what was measured of the recordings; nobody looked at the films" in told
    rows = read_own_files(compared, VIDEO_SCORES)
    assert (rows["trials"] == 1).all() and rows["position"].isna().all() and len(rows) == 3
    of = {row["method"]: row for row in rows.to_dict("records")}
    assert (of["direct"]["score"], of["asset2sim"]["score"]) == (1.5, 5.0)
    assert of["direct"]["cons"] == "not done: lid ended at 0.4, not 0; it moved 0.3 rad or 0 m before it was touched"
    assert of["asset2sim"]["pros"] == "the task is done; none of the faults looked for"
    assert "first touched after 1.20 s" in of["asset2sim"]["description"]


@pytest.mark.system
def test_a_variant_without_a_film_is_not_shown_and_told(compared: Path) -> None:
    lines: list[str] = []
    ivw, direct = (compared / name / "prior_household" for name in ("ivw", "direct"))
    (motion_folder(ivw, ASSET, TASK) / "motion.mp4").unlink()
    (motion_folder(direct, ASSET, TASK) / "motion.mp4").write_bytes(b"no film")
    later = datetime(2026, 11, 3, tzinfo=UTC)
    OwnFile(ivw, TRIALS).add(
        [trial_row(Method.IVW, outcome="unreachable", reason="no way", score=None, recorded_at=later)]
    )
    with serve(honest) as server:
        rows = run(compared, server.api_base, lines.append, trials=2)
    assert (
        "2 of 4 variants have a film" in lines[1] and "not shown: ivw, prior/household: unreachable: no way" in lines[1]
    )
    assert "not shown: direct, prior/household: " in lines[1] and "cannot be read" in lines[1]
    assert sorted(rows["method"].unique()) == ["asset2sim", "reference"] and (rows["candidates"] == 2).all()
    assert {len(pictures(body)) for body in server.requests} == {2}


@pytest.mark.system
def test_what_cannot_be_judged_is_one_line_before_anything_is_asked(
    compared: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("GEMINI_API_KEY", "GOOGLE_API_KEY"):
        monkeypatch.delenv(name, raising=False)
    for judge, message in (
        ("prior/household", "sees no pictures"),
        ("recorded/nowhere", "no folder"),
        ("openai/gpt-3.5-turbo", "takes no images"),
        ("nobody/judge", "nobody/judge"),
        ("gemini/gemini-2.5-pro", "needs GEMINI_API_KEY or GOOGLE_API_KEY|needs GOOGLE_API_KEY or GEMINI_API_KEY"),
    ):
        with pytest.raises(UsageError, match=message):
            run(compared, "http://127.0.0.1:9/v1" if "openai" in judge else None, judges=(judge,))
    with pytest.raises(UsageError, match="name a folder on this machine"):
        judge_videos(["s3://bucket/out"], (), 1, 2, 0, ModelSettings(), print)
    twice = [compared, compared / "direct" / "prior_household", compared / "copy"]
    write_run(compared / "copy", night(1), [make_record(ASSET, method=Method.DIRECT)])
    with pytest.raises(UsageError, match="no recorded interaction; asset2sim record-motion makes them"):
        judge_videos([compared / "copy"], (), 1, 2, 0, ModelSettings(), print)
    OwnFile(compared / "copy", TRIALS).add([trial_row(Method.DIRECT)])
    with pytest.raises(UsageError, match="both hold 'trashcan close' with asset 102181 by direct"):
        judge_videos(twice, (), 1, 2, 0, ModelSettings(), print)
    assert read_own_files(compared, VIDEO_SCORES).empty


def test_the_command_s_options_become_settings() -> None:
    words = ["judge-videos", "a", "b", "--judges", "openai/one,openai/one,physical-judge", "--api-base", "http://h/v1"]
    words += ["--budget-usd", "2", "--budget-calls", "9", "--budget-tokens", "90", "--rpm", "3", "--no-answer-cache"]
    options = parse(words)
    assert isinstance(options, JudgeVideosOptions) and options.outs == ("a", "b")
    assert options.judges == ("openai/one", PHYSICAL_JUDGE) and (options.trials, options.frames, options.seed) == (
        10,
        12,
        0,
    )
    assert settings_for_run(None, stated_settings(options)).model == ModelSettings(
        api_base="http://h/v1", run_usd=2.0, run_calls=9, run_tokens=90, requests_per_minute=3.0, cache=False
    )


def test_an_address_goes_with_the_first_judge_that_is_asked_at_one() -> None:
    settings = ModelSettings(api_base="http://127.0.0.1:9/v1", refinement_model="openai/x")
    judges = ("recorded/answers", "openai/one", "anthropic/two", "openai/three")
    found = {judge: judge_settings(settings, judges, judge) for judge in judges}
    assert [found[judge].api_base is not None for judge in judges] == [False, True, False, True]
    assert all(found[judge].model == judge and found[judge].judge_model is None for judge in judges)
