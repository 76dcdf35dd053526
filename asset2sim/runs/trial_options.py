"""The options of the command that records what a scripted arm does with refined objects."""

from pathlib import Path

from pydantic import Field
from pydantic_settings import CliDualFlag, CliPositionalArg

from asset2sim.runs.option_groups import FileOptions
from asset2sim.runs.option_types import FILE, FOLDERS, GRIPPER, IDS, Listed, N
from schemas.errors import UsageError
from schemas.location import is_url


class RecordMotionOptions(FileOptions):
    """Let a scripted arm do a task with each refined object, film it, and judge the recording."""

    outs: CliPositionalArg[FOLDERS] = Field(description="output folders of runs, or that of a comparison")
    assets: Listed[IDS] = Field((), description="only these assets, separated by commas")
    gripper: GRIPPER = Field("panda", description="panda, the arm's own, or robotiq: a 2F-85, from robosuite's package")
    film: CliDualFlag[bool] = Field(True, description="write an MP4 of each trial")
    workers: N | None = Field(None, description="trials at once (default: all cores)")
    page: FILE | None = Field(None, description="write the tables between this file's markers too")
    readme: FILE | None = Field(None, description="write the methods' table alone between this file's markers")

    def folders(self) -> tuple[Path, ...]:
        """The output folders. Raises UsageError for a URL: recordings are written beside the objects."""
        for out in self.outs:
            if is_url(out):
                raise UsageError(f"{out}: trials are recorded beside the objects; fetch the output into a folder first")
        return tuple(Path(out) for out in self.outs)
