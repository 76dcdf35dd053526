"""Options of the commands that rate variants, score their films and show what came of both."""

from pydantic import Field
from pydantic_settings import CliDualFlag, CliPositionalArg

from asset2sim.runs import option_types as typed
from asset2sim.runs.command_line import Options
from asset2sim.runs.option_groups import FileOptions
from lab.options import lab_types
from schemas.vocabulary import Engine


class JudgeVideosOptions(FileOptions):
    """Score the films of recorded interactions, candidates side by side and anonymous, by one or more judges."""

    outs: CliPositionalArg[typed.FOLDERS] = Field(
        description="output folders, or that of a comparison, as asset2sim record-motion left them; the first gets the "
        "scores"
    )
    judges: typed.Chosen[typed.IDS] = Field(
        (), description="vision models, recorded/FOLDER, or physical-judge: a formula over measurements (the default)"
    )
    trials: typed.N = Field(10, description="looks of each model at each task, each in another order")
    frames: typed.N = Field(12, description="frames of each film, spread evenly over what moves")
    record: lab_types.FOLDER | None = Field(
        None, description="a folder to keep the answers in, for --judges recorded/FOLDER/JUDGE with the same seed"
    )
    real: lab_types.FOLDER | None = Field(
        None,
        description="a folder of films of reality, laptop-fold.mp4 for 'laptop fold': each its task's first candidate",
    )
    seed: typed.COUNT = Field(0, description="the orders are drawn from it")
    api_base: typed.URL | None = Field(
        None, description="the address of a server of your own for the first of the models"
    )
    budget_usd: typed.USD | None = Field(None, description="the most that all calls may cost")
    budget_calls: typed.COUNT | None = Field(None, description="the most calls, attempts counted")
    budget_tokens: typed.COUNT | None = Field(None, description="the most tokens")
    rpm: typed.RATE | None = Field(None, description="the most requests a minute to a provider")
    answer_cache: CliDualFlag[bool] = Field(True, description="use answers to the same question, in the same order")


class RateOptions(FileOptions):
    """Let people rate anonymous variants of the same objects: a page on this machine, in three stages."""

    outs: CliPositionalArg[typed.FOLDERS] = Field(
        description="output folders of runs over the same objects, or that of a comparison; the first keeps the ratings"
    )
    methods: typed.Chosen[lab_types.METHODS] = Field(
        (), description="only variants of these methods (default: all that are there)"
    )
    assets: typed.Chosen[typed.IDS] = Field((), description="only these assets, separated by commas")
    engine: typed.ENGINE = Field(Engine.PYBULLET, description=f"the engine: {', '.join(typed.VIEWED)}")
    seed: typed.COUNT = Field(0, description="seed of the order, with the rater's name")
    push_seconds: typed.SECONDS = Field(60.0, description="the least time of the third stage; the most is twice that")
    host: typed.NAME = Field(
        "127.0.0.1", description="the address to serve on; others let any machine that reaches it in"
    )
    port: typed.PORT = Field(8080, description="the port to serve on")


class RatingsOptions(Options):
    """Print what people made of variants, and judges of videos: per method, agreement, order, beside our verdicts."""

    outs: CliPositionalArg[typed.FOLDERS] = Field(
        (), description="output folders, or that of a comparison, as asset2sim rate took them"
    )
    published: lab_types.FOLDER | None = Field(
        None, description="a folder with the paper's human_ratings.csv and video_judges.csv, to print these too"
    )
