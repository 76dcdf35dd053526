"""Groups of options that several commands of ``asset2sim`` have, and the options of those that show pages."""

from pydantic import Field
from pydantic_settings import CliDualFlag, CliPositionalArg, CliToggleFlag

from asset2sim.runs import option_types as typed
from asset2sim.runs.command_line import Options
from schemas.extensions import checks
from schemas.settings import ModelSettings
from schemas.vocabulary import Correction, Engine


class FileOptions(Options):
    """The option for a settings file."""

    settings: typed.FILE | None = Field(
        None, description="a YAML or TOML file of settings; what an option says goes first"
    )


class ModelOptions(FileOptions):
    """Which models are asked."""

    model: typed.NAME = Field(ModelSettings().model, description="any LiteLLM model, or recorded/FOLDER")
    api_base: typed.URL | None = Field(None, description="the address of a server of your own for that model")
    refinement_model: typed.NAME | None = Field(None, description="another model for steps of the state")
    judge_model: typed.NAME | None = Field(None, description="a vision model that scores the result against its prompt")


class Chosen(Options):
    """Which assets of a dataset are taken."""

    subset: typed.NAME | None = Field(None, description="only the manifest's rows of this subset")
    assets: typed.Chosen[typed.IDS] = Field((), description="only these assets, separated by commas")
    limit: typed.N | None = Field(None, description="only the first N of them")


class Selection(Chosen):
    """Which assets of a dataset are taken, where they are verified, and how many at once."""

    interaction: CliDualFlag[bool] = Field(
        True, description="drops, nudges, sweeps and resets beside the paper's tests"
    )
    check: typed.Listed[typed.CHECKS] = Field(
        (), description=f"further checks, seconds an object: {', '.join(checks()) or 'none is installed'}"
    )
    workers: typed.N | None = Field(None, description="assets at work at once (default: all cores)")


class AnswerOptions(Options):
    """How far a model's answer is taken as it is."""

    correct: typed.CORRECT | None = Field(
        None,
        description=f"{', '.join(Correction)}: what rules may change of an answer (default: semantic for prior/…, "
        "units for other models)",
    )
    ask_again: CliDualFlag[bool] = Field(
        True,
        description="ask once more, with what an answer comes to, where that is doubtful; of prior/… and with "
        "--correct semantic only where stated",
    )
    samples: typed.N | None = Field(
        None, description="the most answers where a model is unsure; their median (default: 1)"
    )


class CatalogOptions(Options):
    """Read what a run wrote."""

    out: typed.OUT = Field(description="a run's folder or URL")


HOST = Field("127.0.0.1", description="the address to serve on; 0.0.0.0 lets any machine that reaches this one in")


class ViewOptions(CatalogOptions, FileOptions):
    """Look at refined objects and touch them, beside the raw ones, and review them: a page on this machine."""

    asset_id: CliPositionalArg[typed.NAME | None] = Field(
        None, description="the asset to begin with (default: the first)"
    )
    engine: typed.ENGINE = Field(Engine.PYBULLET, description=f"the engine to begin with: {', '.join(typed.VIEWED)}")
    host: typed.NAME = HOST
    port: typed.PORT = Field(8080, description="the port to serve on")


class ReportOptions(CatalogOptions, FileOptions):
    """Write the report for people, OUT/report: an index and a page an object, as a run does at its end, with loops."""

    workers: typed.N | None = Field(None, description="objects drawn at once (default: all cores)")
    force: CliToggleFlag[bool] = Field(False, description="make every page anew")


class PagesOptions(CatalogOptions):
    """Serve the report and the pages of Prefect and MLflow."""

    host: typed.NAME = HOST
    report_port: typed.PORT = Field(4100, description="port for the report")
    prefect_port: typed.PORT = Field(4200, description="port for Prefect's pages")
    mlflow_port: typed.PORT = Field(5000, description="port for MLflow's pages")
