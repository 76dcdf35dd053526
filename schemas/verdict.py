"""Verdicts on a check of one subject in one engine, on an engine's report and on an object; failure modes in words."""

from dataclasses import dataclass
from typing import NamedTuple

from schemas.vocabulary import FAILURE_ROWS, Engine, FailureMode


@dataclass(frozen=True)
class CheckVerdict:
    """One check of one subject (a joint, a drop or a start) in one engine: ``value`` against ``limit``, and why."""

    test: FailureMode
    subject: str
    passed: bool
    value: float | None
    limit: float | None
    reason: str
    way: str | None = None
    """Of an effort, which way the part is moved: "opening" or "closing"."""


@dataclass(frozen=True)
class Verdict:
    """The mode that failed, or ``none``, the ``reason`` in words, and the ``value`` and ``limit`` compared."""

    mode: FailureMode
    reason: str
    value: float | None = None
    limit: float | None = None

    @property
    def passed(self) -> bool:
        """Whether the asset is interaction-ready by these thresholds."""
        return self.mode is FailureMode.NONE


@dataclass(frozen=True)
class Failure:
    """One failed check in one engine: the joint or start (``subject``), the value, and the limit that it exceeds."""

    engine: Engine
    mode: FailureMode
    subject: str
    reason: str
    value: float | None
    limit: float | None

    @property
    def key(self) -> tuple[Engine, FailureMode, str]:
        """Engine, mode and subject: identify a failure across measurements."""
        return self.engine, self.mode, self.subject


@dataclass(frozen=True)
class Judged:
    """The verdict on one engine's report: one for each check and subject, and all failures, the paper's first."""

    checks: tuple[CheckVerdict, ...]
    failures: tuple[Failure, ...]


class Guide(NamedTuple):
    """One failure mode in words: what was seen, and what to do about it."""

    cause: str
    remedy: str


FAILURE_GUIDE = {mode: Guide(row["cause"], row["remedy"]) for mode, row in FAILURE_ROWS.items() if row["cause"]}
"""Failure mode that no check shows → its cause and remedy; those of checks stand with them, and
``asset2sim.checks.declared_check`` has all."""
