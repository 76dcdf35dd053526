"""Options of the laboratory's commands, and their types beside those of ``asset2sim.runs.option_types``."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field
from pydantic_settings import CliDualFlag, CliPositionalArg, CliToggleFlag
from typing_extensions import TypeAliasType

from asset2sim.runs import option_types as typed
from asset2sim.runs.command_line import Options
from asset2sim.runs.option_groups import FileOptions
from schemas.base import Positive
from schemas.errors import UsageError
from schemas.vocabulary import Engine, Method


def actions(text: object) -> object:
    """A number of actions, also as 2e6."""
    try:
        return int(float(text)) if isinstance(text, str) else text
    except (ValueError, OverflowError):
        return text  # which is refused as no whole number


def methods_named(names: tuple[str, ...]) -> tuple[str, ...]:
    """Names of methods; ``ours`` is Asset2Sim's. Raises ValueError."""
    found = tuple(Method.ASSET2SIM.value if name == "ours" else name for name in names)
    for name in found:
        if name not in set(Method):
            raise ValueError(f"'{name}' is no method; choose from ours, {', '.join(Method)}")
    return found


STEPS = TypeAliasType("STEPS", Annotated[int, BeforeValidator(actions), Field(ge=1)])
MINUTES = TypeAliasType("MINUTES", Positive)
METHODS = TypeAliasType("METHODS", tuple[Method, ...])
FOLDER = TypeAliasType("FOLDER", Path)
GRIPPER = TypeAliasType("GRIPPER", Literal["panda", "robotiq"])
ACTIONS = TypeAliasType("ACTIONS", Literal["joint_velocity", "joint_position"])
CAMERA = TypeAliasType("CAMERA", Literal["left", "right"])


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

    out: FOLDER = Field(description="the folder for policies, tables and films; trainings in it go on")
    tasks: typed.Chosen[typed.IDS] = Field(
        (), description="paper9, or names of tasks, as 'laptop fold' (default: every object's)"
    )
    methods: Annotated[typed.Chosen[typed.IDS], AfterValidator(methods_named)] = Field(
        (), description="only objects of these methods; ours is asset2sim (default: all)"
    )
    budget: STEPS = Field(2_000_000, description="the most actions of a training, as 2e6")
    minutes: MINUTES = Field(30.0, description="the most minutes of a training")
    seeds: typed.N = Field(3, description="trainings of each object, with the seeds 0, 1, …")
    warp: typed.N | None = Field(
        None, description="train in so many worlds of MuJoCo Warp at once, on a GPU where there is one (extra warp)"
    )
    force: CliToggleFlag[bool] = Field(False, description="begin anew, also what has ended")
    published: FOLDER | None = Field(None, description="the paper's tables, for a column beside ours")


class RecordMotionOptions(TrialOptions):
    """Let a scripted arm do a task with each refined object, film it, and judge the recording."""

    gripper: GRIPPER = Field("panda", description="panda, the arm's own, or robotiq: a 2F-85, from robosuite's package")


class ProbeOptions(TrialOptions):
    """Let a policy behind a socket do the paper's tasks with each refined object, in the DROID scene, and compare."""

    policy: typed.NAME = Field(
        description="openpi://HOST:PORT, wss://HOST, gr00t://HOST:PORT, or a probe of ours: scripted, noisy, cloned"
    )
    name: typed.NAME | None = Field(
        None, description="the name of a server's policy, as pi0.5-DROID (default: its address); SRCC goes by it"
    )
    actions: ACTIONS = Field(
        "joint_velocity", description="what openpi's actions are: joint_velocity or joint_position"
    )
    camera: CAMERA = Field("left", description="the outside camera that the policy sees: left or right")
    gripper: GRIPPER = Field(
        "robotiq", description="robotiq, DROID's, from robosuite's package, or panda, the arm's own"
    )
    network: typed.FILE | None = Field(None, description="of cloned: the file that make clone has written")
    tasks: typed.Chosen[typed.IDS] = Field(
        ("paper11",), description="paper11, or names as 'box close', separated by commas"
    )
    trials: typed.N = Field(5, description="trials of each task with each object")
    seed: typed.COUNT = Field(0, description="seed of the first trial's start; the next ones have the next seeds")
    methods: typed.Chosen[METHODS] = Field((), description="only these methods, separated by commas")
    force: CliToggleFlag[bool] = Field(False, description="do trials again that have a result")
    published: FOLDER | None = Field(None, description="the paper's tables: SRCC against what acted in reality")


class JudgeVideosOptions(FileOptions):
    """Score the films of recorded interactions, candidates side by side and anonymous, by one or more judges."""

    outs: CliPositionalArg[typed.FOLDERS] = Field(
        description="output folders, or that of a comparison, as asset2sim record-motion left them; the first gets the "
        "scores"
    )
    judges: typed.Chosen[typed.IDS] = Field(
        (), description="vision models, recorded/FOLDER, or physical-judge: a formula over measurements (the default)"
    )
    trials: typed.N = Field(10, description="looks of each model at each task, each in another order")
    frames: typed.N = Field(12, description="frames of each film, spread evenly over what moves")
    record: FOLDER | None = Field(
        None, description="a folder to keep the answers in, for --judges recorded/FOLDER/JUDGE with the same seed"
    )
    real: FOLDER | None = Field(
        None,
        description="a folder of films of reality, laptop-fold.mp4 for 'laptop fold': each its task's first candidate",
    )
    seed: typed.COUNT = Field(0, description="the orders are drawn from it")
    api_base: typed.URL | None = Field(
        None, description="the address of a server of your own for the first of the models"
    )
    budget_usd: typed.USD | None = Field(None, description="the most that all calls may cost")
    budget_calls: typed.COUNT | None = Field(None, description="the most calls, attempts counted")
    budget_tokens: typed.COUNT | None = Field(None, description="the most tokens")
    rpm: typed.RATE | None = Field(None, description="the most requests a minute to a provider")
    answer_cache: CliDualFlag[bool] = Field(True, description="use answers to the same question, in the same order")


class RateOptions(FileOptions):
    """Let people rate anonymous variants of the same objects: a page on this machine, in three stages."""

    outs: CliPositionalArg[typed.FOLDERS] = Field(
        description="output folders of runs over the same objects, or that of a comparison; the first keeps the ratings"
    )
    methods: typed.Chosen[METHODS] = Field(
        (), description="only variants of these methods (default: all that are there)"
    )
    assets: typed.Chosen[typed.IDS] = Field((), description="only these assets, separated by commas")
    engine: typed.ENGINE = Field(Engine.PYBULLET, description=f"the engine: {', '.join(typed.VIEWED)}")
    seed: typed.COUNT = Field(0, description="seed of the order, with the rater's name")
    push_seconds: typed.SECONDS = Field(60.0, description="the least time of the third stage; the most is twice that")
    host: typed.NAME = Field(
        "127.0.0.1", description="the address to serve on; others let any machine that reaches it in"
    )
    port: typed.PORT = Field(8080, description="the port to serve on")


class RatingsOptions(Options):
    """Print what people made of variants, and judges of videos: per method, agreement, order, beside our verdicts."""

    outs: CliPositionalArg[typed.FOLDERS] = Field(
        (), description="output folders, or that of a comparison, as asset2sim rate took them"
    )
    published: FOLDER | None = Field(
        None, description="a folder with the paper's human_ratings.csv and video_judges.csv, to print these too"
    )
