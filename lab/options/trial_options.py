"""Options of the commands that record motion, ask a policy and learn."""

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic_settings import CliDualFlag, CliPositionalArg, CliToggleFlag

from asset2sim.runs import option_types as typed
from asset2sim.runs.option_groups import FileOptions
from lab.options import lab_types
from schemas.errors import UsageError


class TrialOptions(FileOptions):
    """Options that all of these commands have."""

    outs: CliPositionalArg[typed.FOLDERS] = Field(description="output folders of runs, or that of a comparison")
    assets: typed.Chosen[typed.IDS] = Field((), description="only these assets, separated by commas")
    film: CliDualFlag[bool] = Field(True, description="write an MP4 of each")
    workers: typed.N | None = Field(None, description="trials or trainings at once (default: all cores)")
    page: typed.FILE | None = Field(None, description="write the tables between this file's markers too")

    def folders(self) -> tuple[Path, ...]:
        """The output folders. Raises UsageError for a URL: recordings are written beside the objects."""
        for out in self.outs:
            if out.is_url:
                raise UsageError(f"{out}: trials are recorded beside the objects; fetch the output into a folder first")
        return tuple(out.folder for out in self.outs)


class LearnOptions(TrialOptions):
    """Let a robot learn to use each refined object: PPO, a training for each object, method and seed."""

    out: lab_types.FOLDER = Field(description="the folder for policies, tables and films; trainings in it go on")
    tasks: typed.Chosen[typed.IDS] = Field(
        (), description="paper9, or names of tasks, as 'laptop fold' (default: every object's)"
    )
    methods: Annotated[typed.Chosen[typed.IDS], AfterValidator(lab_types.methods_named)] = Field(
        (), description="only objects of these methods; ours is asset2sim (default: all)"
    )
    budget: lab_types.STEPS = Field(2_000_000, description="the most actions of a training, as 2e6")
    minutes: lab_types.MINUTES = Field(30.0, description="the most minutes of a training")
    seeds: typed.N = Field(3, description="trainings of each object, with the seeds 0, 1, …")
    warp: typed.N | None = Field(
        None, description="train in so many worlds of MuJoCo Warp at once, on a GPU where there is one (extra warp)"
    )
    force: CliToggleFlag[bool] = Field(False, description="begin anew, also what has ended")
    published: lab_types.FOLDER | None = Field(None, description="the paper's tables, for a column beside ours")


class RecordMotionOptions(TrialOptions):
    """Let a scripted arm do a task with each refined object, film it, and judge the recording."""

    gripper: lab_types.GRIPPER = Field(
        "panda", description="panda, the arm's own, or robotiq: a 2F-85, from robosuite's package"
    )


class ProbeOptions(TrialOptions):
    """Let a policy behind a socket do the paper's tasks with each refined object, in the DROID scene, and compare."""

    policy: typed.NAME = Field(
        description="openpi://HOST:PORT, wss://HOST, gr00t://HOST:PORT, or a probe of ours: scripted, noisy, cloned"
    )
    name: typed.NAME | None = Field(
        None, description="the name of a server's policy, as pi0.5-DROID (default: its address); SRCC goes by it"
    )
    actions: lab_types.ACTIONS = Field(
        "joint_velocity", description="what openpi's actions are: joint_velocity or joint_position"
    )
    camera: lab_types.CAMERA = Field("left", description="the outside camera that the policy sees: left or right")
    gripper: lab_types.GRIPPER = Field(
        "robotiq", description="robotiq, DROID's, from robosuite's package, or panda, the arm's own"
    )
    network: typed.FILE | None = Field(None, description="of cloned: the file that make clone has written")
    tasks: typed.Chosen[typed.IDS] = Field(
        ("paper11",), description="paper11, or names as 'box close', separated by commas"
    )
    trials: typed.N = Field(5, description="trials of each task with each object")
    seed: typed.COUNT = Field(0, description="seed of the first trial's start; the next ones have the next seeds")
    methods: typed.Chosen[lab_types.METHODS] = Field((), description="only these methods, separated by commas")
    force: CliToggleFlag[bool] = Field(False, description="do trials again that have a result")
    published: lab_types.FOLDER | None = Field(
        None, description="the paper's tables: SRCC against what acted in reality"
    )
