"""Options that several commands share, and those of pages, of objects as they are, and of handing objects on."""

from pathlib import Path

from pydantic import Field
from pydantic_settings import CliDualFlag, CliPositionalArg, CliSubCommand, CliToggleFlag

from asset2sim.runs import option_types as typed
from asset2sim.runs.command_line import Options
from schemas.extensions import checks
from schemas.location import Location
from schemas.vocabulary import Engine

SOME = Field((), description="only these assets, separated by commas")
INTERACTION = Field(True, description="drops, nudges, sweeps and resets beside the paper's tests")
AT_ONCE = Field(None, description="assets at work at once (default: all cores)")


class FileOptions(Options):
    """The option for a settings file."""

    settings: typed.FILE | None = Field(
        None, description="a YAML or TOML file of settings; what an option says goes first"
    )


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


@typed.with_settings("check")
class CheckOptions(FileOptions):
    """Check objects as they are, in any format: refined, edited by hand, or foreign. Exits with 0 where all
    pass, 1 where one fails, 2 for a mistake in the command."""

    folders: CliPositionalArg[typed.FOLDERS] = Field(description="assets' folders or files, or folders of those")
    interaction: CliDualFlag[bool] = INTERACTION
    json_: CliToggleFlag[bool] = Field(False, alias="json", description="JSON instead of a table")
    sarif: typed.FILE | None = Field(
        None, description="a file to write failures and warnings to as SARIF 2.1.0, which GitHub shows"
    )
    fix: typed.FILE | None = Field(
        None, description="a folder into which those that fail are refined; exits with 0 where all pass then"
    )
    workers: typed.N | None = Field(None, description="assets checked at once (default: all cores)")


@typed.with_settings("convert")
class ConvertOptions(FileOptions):
    """Convert objects of any format to URDF, MJCF and USD, their numbers as they are. Exits with 1 if one fails."""

    data: CliPositionalArg[Location] = Field(description="objects, as asset2sim refine takes them")
    out: typed.FILE = Field(description="the output folder: OUT/assets/<asset_id>")
    workers: typed.N | None = Field(None, description="objects converted at once (default: all cores)")


class DescribeOptions(Options):
    """Say what a refined object is: joints, ranges, what holds, where to pull, support, mass, verdict."""

    folder: CliPositionalArg[Path] = Field(description="a refined object's folder: OUT/assets/<asset_id>")


class ExportOverlaysOptions(Options):
    """Write numbers, checks and content hashes of the objects that passed, and no geometry of the dataset's."""

    run: CliPositionalArg[Path] = Field(description="a run's folder (OUT of asset2sim refine)")
    out: Path = Field(description="the overlay folder to write")
    assets: typed.Chosen[typed.IDS] = SOME


@typed.with_settings("apply")
class ApplyOverlaysOptions(FileOptions):
    """Make the refined objects of an overlay folder on your copy of its dataset. Exits with 1 if one differs."""

    overlays: CliPositionalArg[Path] = Field(description="a folder that asset2sim overlays export wrote")
    data: CliPositionalArg[Path] = Field(description="your copy of the dataset, as asset2sim refine takes it")
    out: Path = Field(description="the output folder")
    assets: typed.Chosen[typed.IDS] = SOME
    workers: typed.N | None = AT_ONCE


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
