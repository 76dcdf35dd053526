"""Options of the commands that hand refined objects on: overlays without geometry, and packs for other tools."""

from pathlib import Path

from pydantic import Field
from pydantic_settings import CliDualFlag, CliPositionalArg, CliSubCommand

from asset2sim.runs import option_types as typed
from asset2sim.runs.command_line import Options
from asset2sim.runs.option_groups import FileOptions


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
