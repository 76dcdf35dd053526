"""The options of the command that lets a robot learn to use refined objects."""

from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic_settings import CliDualFlag, CliPositionalArg, CliToggleFlag

from asset2sim.runs.option_groups import FileOptions
from asset2sim.runs.option_types import FILE, FOLDER, FOLDERS, IDS, MINUTES, STEPS, Chosen, N, methods_named


class LearnOptions(FileOptions):
    """Let a robot learn to use each refined object: PPO, a training for each object, method and seed."""

    outs: CliPositionalArg[FOLDERS] = Field(description="output folders of runs, or that of a comparison")
    out: FOLDER = Field(description="the folder for policies, tables and films; trainings in it go on")
    tasks: Chosen[IDS] = Field((), description="paper9, or names of tasks, as 'laptop fold' (default: every object's)")
    methods: Annotated[Chosen[IDS], AfterValidator(methods_named)] = Field(
        (), description="only objects of these methods; ours is asset2sim (default: all)"
    )
    assets: Chosen[IDS] = Field((), description="only these assets, separated by commas")
    budget: STEPS = Field(2_000_000, description="the most actions of a training, as 2e6")
    minutes: MINUTES = Field(30.0, description="the most minutes of a training")
    seeds: N = Field(3, description="trainings of each object, with the seeds 0, 1, …")
    warp: N | None = Field(
        None, description="train in so many worlds of MuJoCo Warp at once, on a GPU where there is one (extra warp)"
    )
    workers: N | None = Field(None, description="trainings at once, each one thread (default: all cores)")
    film: CliDualFlag[bool] = Field(True, description="write an MP4 of a rollout of each")
    force: CliToggleFlag[bool] = Field(False, description="begin anew, also what has ended")
    page: FILE | None = Field(None, description="write the table between this file's markers too, curves beside it")
    published: FOLDER | None = Field(None, description="the paper's tables, for a column beside ours")
