"""The options of the commands that let people rate variants, and that print what they made of them."""

from pydantic import Field
from pydantic_settings import CliPositionalArg

from asset2sim.runs.command_line import Options
from asset2sim.runs.option_groups import FileOptions
from asset2sim.runs.option_types import (
    COUNT,
    ENGINE,
    FOLDER,
    FOLDERS,
    IDS,
    METHODS,
    NAME,
    PORT,
    SECONDS,
    VIEWED,
    Chosen,
)
from schemas.vocabulary import Engine


class RateOptions(FileOptions):
    """Let people rate anonymous variants of the same objects: a page on this machine, in three stages."""

    outs: CliPositionalArg[FOLDERS] = Field(
        description="output folders of runs over the same objects, or that of a comparison; the first keeps the ratings"
    )
    methods: Chosen[METHODS] = Field((), description="only variants of these methods (default: all that are there)")
    assets: Chosen[IDS] = Field((), description="only these assets, separated by commas")
    engine: ENGINE = Field(Engine.PYBULLET, description=f"the engine: {', '.join(VIEWED)}")
    seed: COUNT = Field(0, description="seed of the order, with the rater's name")
    push_seconds: SECONDS = Field(60.0, description="the least time of the third stage; the most is twice that")
    host: NAME = Field("127.0.0.1", description="the address to serve on; others let any machine that reaches it in")
    port: PORT = Field(8080, description="the port to serve on")


class RatingsOptions(Options):
    """Print what people made of variants, and judges of videos: per method, agreement, order, beside our verdicts."""

    outs: CliPositionalArg[FOLDERS] = Field(
        (), description="output folders, or that of a comparison, as asset2sim rate took them"
    )
    published: FOLDER | None = Field(
        None, description="a folder with the paper's human_ratings.csv and video_judges.csv, to print these too"
    )
