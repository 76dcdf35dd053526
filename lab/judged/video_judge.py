"""Judging films by vision models: trials in orders drawn by lot, several at once; what fails is a row without score."""

import logging
import threading
import uuid
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from asset2sim.models.ask_overlay import MAX_ASKS, Replies, ask_until_valid
from asset2sim.models.gateway.abilities import check_model, model_abilities
from asset2sim.models.gateway.ask import ask
from asset2sim.models.gateway.environment import find_provider, listed, missing_variables
from asset2sim.models.gateway.session import open_gateway_session
from lab.judged.video_candidates import Candidate, TaskComparison, order_of, trial_seeds
from lab.judged.video_frames import FilmFrame, UnreadableFilmError, sampled_frames
from lab.judged.video_prompt import CandidateAnswer, parse_video_answer, video_request
from lab.schemas.tables import VIDEO_SCORES
from schemas.errors import UsageError
from schemas.model_names import is_local, is_prior, settings_for
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import ModelSettings
from schemas.table import Row

log = logging.getLogger(__name__)

Films = dict[Candidate, tuple[FilmFrame, ...]]


@dataclass(frozen=True)
class JudgingRun:
    """One run of judges: where its cache and budget are, and how it asks. ``settings`` are those of all judges."""

    out: Path
    judges: tuple[str, ...]
    trials: int
    frames: int
    seed: int
    settings: ModelSettings
    run_id: str


@dataclass(frozen=True)
class JudgeTrial:
    """One look of a judge at a task's candidates, in the order of its seed."""

    about: TaskComparison
    judge: str
    number: int
    seed: int
    began: datetime


@dataclass(frozen=True)
class TrialJudgement:
    """Judgement of a trial: its rows of ``video_scores``, and what the judge was asked and answered."""

    look: JudgeTrial
    rows: list[Row]
    request: ModelRequest
    answers: tuple[ModelAnswer, ...]


def open_judging_run(
    out: Path, judges: Sequence[str], trials: int, frames: int, seed: int, settings: ModelSettings
) -> JudgingRun:
    """A run of these judges. Raises UsageError for one that cannot be asked or cannot see, before anything is."""
    for judge in judges:
        if is_prior(judge):
            raise UsageError(f"judge '{judge}' runs in this process and sees no pictures; name a vision model")
        asked = judge_settings(settings, judges, judge)
        missing = missing_variables(asked) if find_provider(judge) is not None else ()
        if missing:
            raise UsageError(
                f"judge '{judge}' needs {listed(missing)} in the environment or in .env: set it, or name "
                "recorded/FOLDER or physical-judge, which need no key"
            )
        check_model(asked)
        if not is_local(judge) and not model_abilities(judge).images:
            raise UsageError(f"judge '{judge}' takes no images, by LiteLLM's list of models; name a vision model")
    return JudgingRun(out, tuple(judges), trials, frames, seed, settings, f"judge-{uuid.uuid4().hex}")


def judge_settings(settings: ModelSettings, judges: Sequence[str], judge: str) -> ModelSettings:
    """The settings for one of several judges: an address goes with the provider of the first that is asked at one."""
    first = next((name for name in judges if not is_local(name)), judge)
    named = settings.model_copy(update={"model": first, "refinement_model": None, "judge_model": judge})
    return settings_for(named, judge)


def judged(run: JudgingRun, about: Sequence[TaskComparison], told: Callable[[str], None]) -> Iterator[TrialJudgement]:
    """Judgement of each trial, as they end; ``told`` hears what is shown of each task, and what has
    no film. An interruption ends every wait."""
    stopped = threading.Event()
    pool = ThreadPoolExecutor(run.settings.concurrent_requests, thread_name_prefix="judge")
    try:
        for item in about:
            shown, films = _watchable(run, item)
            lost = "".join(f"\n  not shown: {line}" for line in shown.missing)
            every = len(shown.candidates) + len(shown.missing)
            told(f"{shown.task} of {shown.asset_id}: {len(shown.candidates)} of {every} variants have a film{lost}")
            if not films:
                continue
            seeds, began = trial_seeds(shown, run.trials, run.seed), datetime.now(UTC)
            looks = [
                JudgeTrial(shown, judge, number, seed, began)
                for judge in run.judges
                for number, seed in enumerate(seeds)
            ]
            for future in as_completed(pool.submit(judge_trial, run, look, films, stopped.is_set) for look in looks):
                yield future.result()
    finally:
        stopped.set()
        pool.shutdown(cancel_futures=True)


def _watchable(run: JudgingRun, about: TaskComparison) -> tuple[TaskComparison, Films]:
    """The comparison with what cannot be decoded among the missing, and the frames of the others."""
    films: Films = {}
    missing = list(about.missing)
    for item in about.candidates:
        try:
            films[item] = sampled_frames(item.film, run.frames, run.settings.image_side_px)
        except UnreadableFilmError as error:
            missing.append(f"{item.method}, {item.model}: {error}")
    return replace(about, candidates=tuple(films), missing=tuple(missing)), films


def judge_trial(run: JudgingRun, look: JudgeTrial, films: Films, stopped: Callable[[], bool]) -> TrialJudgement:
    """A trial, with a row for each candidate: its score, or why there is none."""
    settings = judge_settings(run.settings, run.judges, look.judge)
    shown = order_of(tuple(films), look.seed)
    request = video_request(look.about.task, look.about.verb, [films[item] for item in shown], look.seed)
    # A session of its own: a recorded judge counts the questions of each trial by themselves.
    session = open_gateway_session(run.out, run.run_id, look.about.asset_id, settings, stopped)
    said = ask_until_valid(
        request, partial(ask, settings=settings, session=session), lambda text: parse_video_answer(text, len(shown))
    )
    reason = why_no_score(said)
    if said.answers[-1].other_question is not None:
        log.warning("%s: the recorded answer %s", look.judge, said.answers[-1].other_question)
    common: Row = {
        "task": look.about.task,
        "asset_id": look.about.asset_id,
        "judge": look.judge,
        "trial": look.number,
        "trials": 1,
        "candidates": len(shown),
        "seed": look.seed,
        "frames": run.frames,
        "temperature": None if is_local(look.judge) else settings.temperature,
        "cost_usd": sum(call.cost_usd for call in said.calls) / len(shown),
        "judged_at": look.began,
        "reason": reason,
    }
    answers: Sequence[CandidateAnswer | None] = [None] * len(shown) if reason or said.value is None else said.value
    rows = [
        dict.fromkeys(VIDEO_SCORES.schema.names)
        | common
        | {"method": item.method, "model": item.model, "run_id": item.run_id, "position": place}
        | ({} if answer is None else answer.model_dump(include={"description", "pros", "cons", "score"}))
        for place, (item, answer) in enumerate(zip(shown, answers, strict=True))
    ]
    return TrialJudgement(look, rows, request, said.answers)


def why_no_score(said: Replies[tuple[CandidateAnswer, ...]]) -> str | None:
    """Why answers make no score: none came, none fits, or they are of a judge that saw nothing; None where they do."""
    last = said.answers[-1]
    if last.without_images is not None:
        return f"it was not shown the frames: {last.without_images}"
    if said.value is not None:
        return None
    if last.content is not None:
        return f"it answered {MAX_ASKS} times and no answer fits: {said.refused[-1]}"
    refused = f"its answer does not fit: {said.refused[-1]}; " if said.refused else ""
    return refused + (last.error or "it did not answer")
