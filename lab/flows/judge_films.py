"""Judging the films of recorded interactions, as a flow: several judges, a row a candidate, and what the scores say."""

import pandas as pd
from rich.text import Text

from asset2sim.catalog.text import output
from lab.flows.in_flow import in_flow
from lab.judged.judge_videos import judge_videos
from lab.judged.show_ratings import describe_scores
from lab.options import JudgeVideosOptions
from schemas.settings import Settings


def judge_films(options: JudgeVideosOptions, settings: Settings) -> None:
    """Have the films of output folders judged; print how far it is, and in the end what the scores come to. Raises
    UsageError as ``judge_videos`` does."""
    looks = options.trials, options.frames, options.seed

    def judge() -> pd.DataFrame:
        def told(line: str) -> None:
            output().print(Text(line))

        return judge_videos(options.outs, options.judges, *looks, settings.model, told, options.record, options.real)

    scores = in_flow("judge-videos", judge)
    for part in describe_scores("Video scores", scores):
        output().print(part)
    place = options.outs[0].below("video_scores")
    output().print(Text(f"stored in {place}; asset2sim ratings prints them too"))
