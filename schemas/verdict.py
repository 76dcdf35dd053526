"""Verdicts on a check of one subject in one engine, on an engine's report and on an object; failure modes in words."""

from dataclasses import dataclass
from typing import NamedTuple

from schemas.vocabulary import Engine, FailureMode


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


FAILURE_GUIDE = {
    FailureMode.UNREADABLE_ASSET: Guide(
        "The folder holds no URDF that can be read: not XML, no links, joints in a circle, a link or joint named twice",
        "mend what the finding names (file, link or joint); the next run tries it again because the file changed",
    ),
    FailureMode.MISSING_MESH: Guide(
        "A link that must have a shape has none: its meshes are missing, empty, broken or outside the dataset",
        "put the named mesh where the finding says, or name its package with `--package NAME=PATH`",
    ),
    FailureMode.NO_VALID_ESTIMATE: Guide(
        "The model's answer did not fit the schema, twice",
        "read `OUT/logs/<asset_id>.answers.txt`; use a model that follows a JSON schema",
    ),
    FailureMode.INVALID_JOINT_CONFIGURATION: Guide(
        "A joint cannot be: no parent, limits that leave no range, an axis of length zero",
        "mend the joint that the finding names",
    ),
    FailureMode.ENGINE_REFUSED: Guide(
        "An engine does not load the object as it is written: the reason has its words",
        "mend what it names; with `--method raw` and `asset2sim check` files are as they came: refining mends most",
    ),
    FailureMode.ENGINE_CRASH: Guide(
        "The process that worked on it died",
        "tried again each run; `OUT/logs/<asset_id>.log` has its last words; `--workers` fewer where memory is short",
    ),
    FailureMode.OUT_OF_MEMORY: Guide(
        "It needed more memory than one asset may add (`run.asset_memory_limit_mb`)",
        "tried again each run; give it more memory (`asset2sim settings`), or fewer and smaller meshes",
    ),
    FailureMode.TIMEOUT: Guide(
        "It was not done within its time",
        "tried again each run; give it more time (`asset2sim settings`), or fewer meshes and joints",
    ),
    FailureMode.DISK_FULL: Guide(
        "The disk was full when its files were written", "make room; the next run tries it again"
    ),
    FailureMode.MODEL_ERROR: Guide(
        "The model's server refused or did not answer", "`asset2sim doctor` asks it; the next run tries the asset again"
    ),
    FailureMode.BUDGET: Guide(
        "The run's or the asset's budget was spent before its answer was there",
        "raise `--budget-usd`, `--budget-calls` or `--asset-budget-usd`; the next run goes on",
    ),
}
"""Failure mode that no check shows → its cause and remedy; those of checks stand with them, and
``asset2sim.checks.known_checks`` has all."""
