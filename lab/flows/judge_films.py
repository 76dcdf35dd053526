"""Judging the films of recorded interactions, as a flow: several judges, a row a candidate, and what the scores say."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd
from prefect import flow
from rich.text import Text

from asset2sim.catalog.text import output
from flows.server.client import use_server
from flows.server.server import temporary_server
from lab.judged.judge_videos import judge_videos
from lab.judged.show_ratings import describe_scores
from lab.options.judged_options import JudgeVideosOptions
from schemas.location import below, location_of
from schemas.settings import ModelSettings


def judge_films(options: JudgeVideosOptions, model: ModelSettings) -> None:
    """Have the films of output folders judged; print how far it is, and in the end what the scores come to. Raises
    UsageError as ``judge_videos`` does."""
    with temporary_server() as address, use_server(address):
        scores = judge_films_flow(options, model, lambda line: output().print(Text(line)))
    for part in describe_scores("Video scores", scores):
        output().print(part)
    place = below(location_of(str(options.outs[0])), "video_scores")
    output().print(Text(f"stored in {place}; asset2sim ratings prints them too"))


@flow(name="judge-videos", persist_result=False, validate_parameters=False)
def judge_films_flow(options: JudgeVideosOptions, model: ModelSettings, told: Callable[[str], None]) -> pd.DataFrame:
    """The scores of every judge, trial and candidate."""
    outs: Sequence[Path | str] = options.outs
    looks = options.trials, options.frames, options.seed
    return judge_videos(outs, options.judges, *looks, model, told, options.record)
