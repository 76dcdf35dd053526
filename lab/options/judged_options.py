"""The options of the command that has films judged."""

from pydantic import Field
from pydantic_settings import CliDualFlag, CliPositionalArg

from asset2sim.runs.option_groups import FileOptions
from asset2sim.runs.option_types import COUNT, FOLDER, FOLDERS, IDS, RATE, URL, USD, Chosen, N


class JudgeVideosOptions(FileOptions):
    """Score the films of recorded interactions, candidates side by side and anonymous, by one or more judges."""

    outs: CliPositionalArg[FOLDERS] = Field(
        description="output folders, or that of a comparison, as asset2sim record-motion left them; the first gets the "
        "scores"
    )
    judges: Chosen[IDS] = Field(
        (), description="vision models, recorded/FOLDER, or physical-judge: a formula over measurements (the default)"
    )
    trials: N = Field(10, description="looks of each model at each task, each in another order")
    frames: N = Field(12, description="frames of each film, spread evenly over what moves")
    record: FOLDER | None = Field(
        None, description="a folder to keep the answers in, for --judges recorded/FOLDER/JUDGE with the same seed"
    )
    real: FOLDER | None = Field(
        None,
        description="a folder of films of reality, laptop-fold.mp4 for 'laptop fold': each its task's first candidate",
    )
    seed: COUNT = Field(0, description="the orders are drawn from it")
    api_base: URL | None = Field(None, description="the address of a server of your own for the first of the models")
    budget_usd: USD | None = Field(None, description="the most that all calls may cost")
    budget_calls: COUNT | None = Field(None, description="the most calls, attempts counted")
    budget_tokens: COUNT | None = Field(None, description="the most tokens")
    rpm: RATE | None = Field(None, description="the most requests a minute to a provider")
    answer_cache: CliDualFlag[bool] = Field(True, description="use answers to the same question, in the same order")
