"""``asset2sim judge-videos``: scores of recorded interactions by several judges, into the table ``video_scores``."""

import re
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

import pandas as pd

from asset2sim.catalog.own_files import OwnFile
from asset2sim.experiments.interrupt import sigterm_as_interrupt
from asset2sim.models.gateway.ask import prompt_title
from asset2sim.models.gateway.recorded import RecordingError, answer_names, answer_text, read_recording
from asset2sim.runs.record_answers import write_files
from lab.judged.physical_scores import PHYSICAL_JUDGE, physical_scores
from lab.judged.published import table_frame
from lab.judged.video_candidates import comparisons, recorded_trials
from lab.judged.video_judge import judged, open_judging_run
from lab.schemas.tables import VIDEO_SCORES
from schemas.errors import UsageError
from schemas.request import AnswerOrigin, ModelAnswer
from schemas.settings import ModelSettings


def record_judge(folder: Path, judge: str, asset_id: str, prompt: str | None, answers: tuple[ModelAnswer, ...]) -> None:
    """Write the answers of one trial into the judge's folder below ``folder``, in place of those to the same question.
    Raises UsageError where it takes none."""
    place = folder / re.sub(r"[^\w.@-]", "_", judge)
    texts, origins = dict[str, bytes](), dict[str, AnswerOrigin]()
    now = datetime.now(UTC).replace(microsecond=0)
    for number, answer in enumerate(answers, start=1):
        if answer.content is None or not answer.calls:
            continue
        call = answer.calls[-1]
        name = answer_names(asset_id, call.purpose, number)[0]
        texts[name] = answer_text(answer.content).encode()
        # Of an answer from the cache it is not known here what it took.
        took = {} if call.cached else call.model_dump(include={"prompt_tokens", "completion_tokens", "cost_usd"})
        said = {"model": call.answered_by or judge, "answered_at": now, "prompt": prompt} | took
        origins[name] = AnswerOrigin.model_validate(
            said | {"prompt_hash": call.prompt_hash, "without_images": answer.without_images}
        )
    try:
        before = read_recording(place)
    except RecordingError as error:
        raise UsageError(str(error)) from error
    every = dict(sorted((before.answers | origins).items()))
    changed = {"recorded_at": now, "asset2sim": metadata.version("asset2sim"), "answers": every}
    write_files(place, texts, before.model_copy(update=changed))


def judge_videos(
    outs: Sequence[Path | str],
    judges: Sequence[str],
    trials: int,
    frames: int,
    seed: int,
    settings: ModelSettings,
    told: Callable[[str], None],
    record: Path | None = None,
    real: Path | None = None,
) -> pd.DataFrame:
    """Judge the films of output folders, or of a comparison's, by these judges or, where none is named, the physical
    one. The rows are stored in the first folder, each trial as it ends, and returned; ``told`` hears how far it is, and
    ``record`` is a folder that keeps the judges' answers, ``real`` one of films of reality. Raises UsageError for
    folders without recordings, and for judges that cannot be asked, with nothing done."""
    judges = judges or (PHYSICAL_JUDGE,)
    recorded = recorded_trials(outs)
    models = [judge for judge in judges if judge != PHYSICAL_JUDGE]
    about = comparisons(recorded, real)
    if models and not any(item.candidates for item in about):
        raise UsageError(
            f"{', '.join(map(str, outs))}: no film of a recorded interaction; record them with their films"
        )
    run = open_judging_run(Path(outs[0]), models, trials, frames, seed, settings)
    file = OwnFile(outs[0], VIDEO_SCORES)
    if PHYSICAL_JUDGE in judges:
        file.add(physical_scores(recorded))
        told(f"{PHYSICAL_JUDGE}: {len(file.rows)} of {len(recorded)} recorded trials have a score")
    if models:
        told(f"{trials} trials of {', '.join(models)}, {frames} frames each, temperature {settings.temperature:g}")
        with sigterm_as_interrupt():
            for item in judged(run, about, told):
                file.add(item.rows)
                if record is not None:
                    prompt = prompt_title(item.request)
                    record_judge(record, item.look.judge, item.look.about.asset_id, prompt, item.answers)
    return table_frame(VIDEO_SCORES, list(file.rows))
