"""``asset2sim judge-videos``: scores of recorded interactions by several judges, into the table ``video_scores``."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd

from asset2sim.catalog.own_files import OwnFile
from asset2sim.experiments.interrupt import sigterm_as_interrupt
from asset2sim.models.gateway.ask import prompt_title
from lab.judged.physical_scores import PHYSICAL_JUDGE, physical_scores
from lab.judged.published import table_frame
from lab.judged.record_judges import record_judge
from lab.judged.video_candidates import comparisons, recorded_trials
from lab.judged.video_judge import judged, open_judging_run
from lab.schemas.tables_judged import VIDEO_SCORES
from schemas.errors import UsageError
from schemas.settings import ModelSettings


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
