"""Options that several commands share, and those of pages, of objects as they are, and of handing objects on."""

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic_settings import CliDualFlag, CliPositionalArg, CliSubCommand, CliToggleFlag

from asset2sim.runs import option_types as typed
from asset2sim.runs.command_line import Options
from schemas.extensions import checks
from schemas.location import Location
from schemas.settings import ModelSettings
from schemas.support import SupportKind
from schemas.vocabulary import Correction, Engine, Export, UpAxis

PACKAGE = Field((), description="a folder outside data that is read as package://NAME/…, repeatable")
MACRO = Field(
    "", description="the macro that is read of xacro files that only define macros, its arguments at their defaults"
)
ALLOW_OUTSIDE = Field(False, description="read files outside data that an asset names or links to")
SOME = Field((), description="only these assets, separated by commas")
INTERACTION = Field(True, description="drops, nudges, sweeps and resets beside the paper's tests")
AT_ONCE = Field(None, description="assets at work at once (default: all cores)")


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


class ChosenAssets(Options):
    """Which assets of a dataset are taken."""

    subset: typed.NAME | None = Field(None, description="only the manifest's rows of this subset")
    assets: typed.Chosen[typed.IDS] = SOME
    limit: typed.N | None = Field(None, description="only the first N of them")


class Selection(ChosenAssets):
    """Which assets of a dataset are taken, where they are verified, and how many at once."""

    interaction: CliDualFlag[bool] = INTERACTION
    check: typed.Listed[typed.CHECKS] = Field(
        (), description=f"further checks, seconds an object: {', '.join(checks()) or 'none is installed'}"
    )
    workers: typed.N | None = AT_ONCE


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


class CheckOptions(FileOptions):
    """Check objects as they are, in any format: refined, edited by hand, or foreign. Exits with 0 where all
    pass, 1 where one fails, 2 for a mistake in the command."""

    folders: CliPositionalArg[typed.FOLDERS] = Field(description="assets' folders or files, or folders of those")
    engines: Annotated[typed.Listed[typed.ENGINES | None], AfterValidator(typed.none_if_empty)] = Field(
        None, description=f"engines to check in: {', '.join(Engine)} (default: all installed)"
    )
    interaction: CliDualFlag[bool] = INTERACTION
    support: typed.SUPPORT | None = Field(
        None, description=f"{', '.join(SupportKind)}: what carries them (default: their overlay.json, else found)"
    )
    up: typed.AXIS | None = Field(
        None, description=f"{', '.join(UpAxis)}: the axis that points up in the files (default: z)"
    )
    json_: CliToggleFlag[bool] = Field(False, alias="json", description="JSON instead of a table")
    sarif: typed.FILE | None = Field(
        None, description="a file to write failures and warnings to as SARIF 2.1.0, which GitHub shows"
    )
    fix: typed.FILE | None = Field(
        None, description="a folder into which those that fail are refined; exits with 0 where all pass then"
    )
    workers: typed.N | None = Field(None, description="assets checked at once (default: all cores)")


class ConvertOptions(FileOptions):
    """Convert objects of any format to URDF, MJCF and USD, their numbers as they are. Exits with 1 if one fails."""

    data: CliPositionalArg[Location] = Field(description="objects, as asset2sim refine takes them")
    out: typed.FILE = Field(description="the output folder: OUT/assets/<asset_id>")
    to: typed.Listed[typed.FORMATS] = Field((), description=f"formats beside the URDF: {', '.join(Export)}")
    up: typed.AXIS | None = Field(None, description=f"{', '.join(UpAxis)}: the axis that points up in the files")
    package: typed.Listed[typed.PACKAGES] = PACKAGE
    macro: typed.NAME = MACRO
    workers: typed.N | None = Field(None, description="objects converted at once (default: all cores)")


class DescribeOptions(Options):
    """Say what a refined object is: joints, ranges, what holds, where to pull, support, mass, verdict."""

    folder: CliPositionalArg[Path] = Field(description="a refined object's folder: OUT/assets/<asset_id>")


class ExportOverlaysOptions(Options):
    """Write numbers, checks and content hashes of the objects that passed, and no geometry of the dataset's."""

    run: CliPositionalArg[Path] = Field(description="a run's folder (OUT of asset2sim refine)")
    out: Path = Field(description="the overlay folder to write")
    assets: typed.Chosen[typed.IDS] = SOME


class ApplyOverlaysOptions(FileOptions):
    """Make the refined objects of an overlay folder on your copy of its dataset. Exits with 1 if one differs."""

    overlays: CliPositionalArg[Path] = Field(description="a folder that asset2sim overlays export wrote")
    data: CliPositionalArg[Path] = Field(description="your copy of the dataset, as asset2sim refine takes it")
    out: Path = Field(description="the output folder")
    assets: typed.Chosen[typed.IDS] = SOME
    workers: typed.N | None = AT_ONCE
    package: typed.Listed[typed.PACKAGES] = PACKAGE
    allow_outside: CliDualFlag[bool] = ALLOW_OUTSIDE


class PackOptions(Options):
    """Write the objects that passed as a folder that another tool takes as it is."""

    run: CliPositionalArg[Path] = Field(description="a run's folder (OUT of asset2sim refine)")
    for_: str = Field(
        alias="for", description="mujoco, gazebo, ros2, isaaclab, robosuite, maniskill, huggingface, lerobot"
    )
    out: Path = Field(description="the folder to write")
    assets: typed.Chosen[typed.IDS] = SOME
    license: str = Field("not stated", description="of the dataset's geometry, as an SPDX name")


class OverlaysOptions(Options):
    """Publish refined objects without their geometry, and make them again on a copy of the dataset."""

    export: CliSubCommand[ExportOverlaysOptions] = Field(description="numbers without geometry, out of a run's folder")
    apply: CliSubCommand[ApplyOverlaysOptions] = Field(description="the refined objects again, on your own copy")
