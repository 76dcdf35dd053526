"""A finding: something a stage noticed or changed, as a row."""

from schemas.base import Frozen
from schemas.vocabulary import Severity, Stage


class Finding(Frozen):
    """One thing that one stage noticed or changed, and what to do about it.

    ``value`` and ``limit`` hold the number found and the bound it met, in the unit that the message names.
    """

    stage: Stage
    severity: Severity
    code: str
    message: str
    link: str | None = None
    joint: str | None = None
    value: float | None = None
    limit: float | None = None
