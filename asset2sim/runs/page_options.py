"""The options of the commands that show pages, the viewer, the report and what is served together, and of ratings."""

from pydantic import Field
from pydantic_settings import CliPositionalArg, CliToggleFlag

from asset2sim.runs.command_line import Options
from asset2sim.runs.option_groups import CatalogOptions, FileOptions
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
    Listed,
    N,
)
from schemas.vocabulary import Engine


class ViewOptions(CatalogOptions, FileOptions):
    """Look at refined objects and touch them, beside the raw ones, and review them: a page on this machine."""

    asset_id: CliPositionalArg[NAME | None] = Field(None, description="the asset to begin with (default: the first)")
    engine: ENGINE = Field(Engine.PYBULLET, description=f"the engine to begin with: {', '.join(VIEWED)}")
    host: NAME = Field("127.0.0.1", description="the address to serve on; others let any machine that reaches it in")
    port: PORT = Field(8080, description="the port to serve on")


class ReportOptions(CatalogOptions, FileOptions):
    """Write the report for people, OUT/report: an index and a page an object, as a run does at its end."""

    workers: N | None = Field(None, description="objects drawn at once (default: all cores)")
    force: CliToggleFlag[bool] = Field(False, description="make every page anew")


class PagesOptions(CatalogOptions):
    """Serve the report and the pages of Prefect and MLflow."""

    report_port: PORT = Field(4100, description="port of 127.0.0.1 for the report")
    prefect_port: PORT = Field(4200, description="port of 127.0.0.1 for Prefect's pages")
    mlflow_port: PORT = Field(5000, description="port of 127.0.0.1 for MLflow's pages")


class RateOptions(FileOptions):
    """Let people rate anonymous variants of the same objects: a page on this machine, in three stages."""

    outs: CliPositionalArg[FOLDERS] = Field(
        description="output folders of runs over the same objects, or that of a comparison; the first keeps the ratings"
    )
    methods: Listed[METHODS] = Field((), description="only variants of these methods (default: all that are there)")
    assets: Listed[IDS] = Field((), description="only these assets, separated by commas")
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
