"""Options of how far a model's answer is taken, and when it is asked again."""

from pydantic import Field
from pydantic_settings import CliDualFlag

from asset2sim.runs.command_line import Options
from asset2sim.runs.option_types import CORRECT, N
from schemas.vocabulary import Correction


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
