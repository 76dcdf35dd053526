"""Groups of options that several commands of ``asset2sim`` have."""

from pydantic import Field
from pydantic_settings import CliDualFlag

from asset2sim.runs.command_line import Options
from asset2sim.runs.option_types import CHECKS, CORRECT, FILE, IDS, NAME, OUT, URL, Chosen, Listed, N
from schemas.extensions import checks
from schemas.settings import ModelSettings
from schemas.vocabulary import Correction


class FileOptions(Options):
    """The option for a settings file."""

    settings: FILE | None = Field(None, description="a YAML or TOML file of settings; what an option says goes first")


class ModelOptions(FileOptions):
    """Which models are asked."""

    model: NAME = Field(ModelSettings().model, description="any LiteLLM model, or recorded/FOLDER")
    api_base: URL | None = Field(None, description="the address of a server of your own for that model")
    refinement_model: NAME | None = Field(None, description="another model for steps of the state")
    judge_model: NAME | None = Field(None, description="a vision model that scores the result against its prompt")


class Selection(Options):
    """Which assets of a dataset are taken, where they are verified, and how many at once."""

    subset: NAME | None = Field(None, description="only the manifest's rows of this subset")
    assets: Chosen[IDS] = Field((), description="only these assets, separated by commas")
    limit: N | None = Field(None, description="only the first N of them")
    interaction: CliDualFlag[bool] = Field(
        True, description="drops, nudges, sweeps and resets beside the paper's tests"
    )
    check: Listed[CHECKS] = Field(
        (), description=f"further checks, seconds an object: {', '.join(checks()) or 'none is installed'}"
    )
    workers: N | None = Field(None, description="assets at work at once (default: all cores)")


class AnswerOptions(Options):
    """How far a model's answer is taken as it is."""

    correct: CORRECT | None = Field(
        None,
        description=f"{', '.join(Correction)}: what rules may change of an answer (default: semantic for prior/…, "
        "units for other models)",
    )
    ask_again: CliDualFlag[bool] = Field(
        True,
        description="ask once more, with what an answer comes to, where that is doubtful; of prior/… and with "
        "--correct semantic only where stated",
    )
    samples: N | None = Field(None, description="the most answers where a model is unsure; their median (default: 1)")


class CatalogOptions(Options):
    """Read what a run wrote."""

    out: OUT = Field(description="a run's folder or URL")
