"""Options of the commands on objects as they are (check, convert, describe), and of those that hand refined ones on."""

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic_settings import CliDualFlag, CliPositionalArg, CliSubCommand, CliToggleFlag

from asset2sim.runs import option_types as typed
from asset2sim.runs.command_line import Options
from asset2sim.runs.option_groups import FileOptions
from schemas.location import Location
from schemas.support import SupportKind
from schemas.vocabulary import Engine, Export, UpAxis


class CheckOptions(FileOptions):
    """Check objects as they are, in any format: refined, edited by hand, or foreign. Exits with 0 where all
    pass, 1 where one fails, 2 for a mistake in the command."""

    folders: CliPositionalArg[typed.FOLDERS] = Field(description="assets' folders or files, or folders of those")
    engines: Annotated[typed.Listed[typed.ENGINES | None], AfterValidator(typed.none_if_empty)] = Field(
        None, description=f"engines to check in: {', '.join(Engine)} (default: all installed)"
    )
    interaction: CliDualFlag[bool] = Field(
        True, description="drops, nudges, sweeps and resets beside the paper's tests"
    )
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
    package: typed.Listed[typed.PACKAGES] = Field(
        (), description="a folder outside data that is read as package://NAME/…, repeatable"
    )
    macro: typed.NAME = Field(
        "", description="the macro that is read of xacro files that only define macros, its arguments at their defaults"
    )
    workers: typed.N | None = Field(None, description="objects converted at once (default: all cores)")


class DescribeOptions(Options):
    """Say what a refined object is: joints, ranges, what holds, where to pull, support, mass, verdict."""

    folder: CliPositionalArg[Path] = Field(description="a refined object's folder: OUT/assets/<asset_id>")


class ExportOverlaysOptions(Options):
    """Write numbers, checks and content hashes of the objects that passed, and no geometry of the dataset's."""

    run: CliPositionalArg[Path] = Field(description="a run's folder (OUT of asset2sim refine)")
    out: Path = Field(description="the overlay folder to write")
    assets: typed.Chosen[typed.IDS] = Field((), description="only these assets, separated by commas")


class ApplyOverlaysOptions(FileOptions):
    """Make the refined objects of an overlay folder on your copy of its dataset. Exits with 1 if one differs."""

    overlays: CliPositionalArg[Path] = Field(description="a folder that asset2sim overlays export wrote")
    data: CliPositionalArg[Path] = Field(description="your copy of the dataset, as asset2sim refine takes it")
    out: Path = Field(description="the output folder")
    assets: typed.Chosen[typed.IDS] = Field((), description="only these assets, separated by commas")
    workers: typed.N | None = Field(None, description="assets at work at once (default: all cores)")
    package: typed.Listed[typed.PACKAGES] = Field(
        (), description="a folder outside data that is read as package://NAME/…, repeatable"
    )
    allow_outside: CliDualFlag[bool] = Field(
        False, description="read files outside data that an asset names or links to"
    )


class PackOptions(Options):
    """Write the objects that passed as a folder that another tool takes as it is."""

    run: CliPositionalArg[Path] = Field(description="a run's folder (OUT of asset2sim refine)")
    for_: str = Field(
        alias="for", description="mujoco, gazebo, ros2, isaaclab, robosuite, maniskill, huggingface, lerobot"
    )
    out: Path = Field(description="the folder to write")
    assets: typed.Chosen[typed.IDS] = Field((), description="only these assets, separated by commas")
    license: str = Field("not stated", description="of the dataset's geometry, as an SPDX name")


class OverlaysOptions(Options):
    """Publish refined objects without their geometry, and make them again on a copy of the dataset."""

    export: CliSubCommand[ExportOverlaysOptions] = Field(description="numbers without geometry, out of a run's folder")
    apply: CliSubCommand[ApplyOverlaysOptions] = Field(description="the refined objects again, on your own copy")
