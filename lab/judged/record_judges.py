"""A judge's answers as a recorded model, which gives them again without a key: ``--judges recorded/FOLDER/JUDGE``."""

import re
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

from asset2sim.models.gateway.recorded import RecordingError, answer_names, answer_text, read_recording
from asset2sim.runs.record_answers import write_files
from schemas.errors import UsageError
from schemas.recording import AnswerOrigin
from schemas.request import ModelAnswer


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
