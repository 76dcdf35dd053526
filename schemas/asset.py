"""One asset to refine, and its result record, as sent between the flow and the workers."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from pydantic import Field

from schemas.alignment import Alignment, Expectation, Expected, Reference
from schemas.base import Finite, Frozen, Positive
from schemas.features import Features
from schemas.finding import Finding, TraceStep
from schemas.guidance import Guidance
from schemas.interaction import EngineReport, Measurement, OverlapPair
from schemas.overlay import PhysicsOverlay
from schemas.request import ModelCall
from schemas.support import SupportKind
from schemas.vocabulary import FailureMode, Method, Status, UpAxis

Unit = Literal["", "share", "deg", "rad", "m"]
"""Of a stated position: the joint's own (""), a share of the way from closed to open, or one that was named."""


class StatedPosition(Frozen):
    """An initial position, in the joint's unit (rad, or m of the refined object), or as a share from closed to open."""

    value: Finite
    unit: Unit = ""


class Overrides(Frozen):
    """A user's statements on one asset; it wins over any model and any prior, and its source is ``user``.

    ``size_m`` is the longest edge of the closed object, ``mass_kg`` the whole object's mass; ``joints`` maps joint →
    initial position, ``materials`` link → material of the table. ``where`` says of each column the file and the line.
    """

    scale: Positive | None = None
    size_m: Positive | None = None
    mass_kg: Positive | None = None
    joints: dict[str, StatedPosition] = Field(default_factory=dict)
    materials: dict[str, str] = Field(default_factory=dict)
    where: dict[str, str] = Field(default_factory=dict)

    def scale_of(self, features: Features) -> float | None:
        """The uniform scale that is stated, or that gives the closed object's longest edge; None without either."""
        if self.size_m is None:
            return self.scale
        return self.size_m / (max(features.closed_size) or max(features.rest_size))

    def place(self, column: str) -> str:
        """File, line and column of a number, for messages."""
        return f"{self.where.get(column, 'overrides')}, column '{column}'"


class Unchanged(Frozen):
    """An asset that a run skipped because an earlier result still holds, with the status of that result."""

    asset_id: str
    status: Status
    failure_mode: FailureMode


class AssetRef(Frozen):
    """An asset's absolute folder or file, category, subset and user prompt. ``support``: what the manifest says carries
    it; ``up``: which axis points up in its file; None: the run's, or what its geometry says. ``root``: the dataset's
    folder or URL, below which its files may lie; None: its own folder. ``fault``: why it cannot be read, where that
    shows before anything is read. ``overrides``: numbers of the user's own. ``reference`` and ``expectations``: an
    expert's choice, and what readers expect; yardsticks, which only the stage ``align`` reads."""

    asset_id: str
    path: str
    category: str | None = None
    subset: str | None = None
    prompt: str | None = None
    support: SupportKind | None = None
    up: UpAxis | None = None
    root: str | None = None
    fault: str | None = None
    overrides: Overrides | None = None
    reference: Reference | None = None
    expectations: tuple[Expectation, ...] = ()
    keep: tuple[str, ...] | None = None
    """Which numbers of its file stay, as its manifest row says; None: the run's."""
    scene: str | None = None
    """The id of the scene that it is cut out of, and the ``part`` that it is there; None: its file is all its own."""
    part: str | None = None

    @property
    def own_numbers(self) -> str | None:
        """The user's own numbers as JSON; None without any."""
        if self.overrides is None:
            return None
        return json.dumps(
            self.overrides.model_dump(mode="json", exclude={"where"}, exclude_defaults=True), sort_keys=True
        )


class FoundAssets:
    """The assets of a checked request, so that its run does not list the dataset again. Neither a dataclass nor a
    pydantic model: as an argument of a flow, Prefect would walk through every reference and store it."""

    __slots__ = ("refs",)

    def __init__(self, refs: Sequence[AssetRef]) -> None:
        self.refs = list(refs)


class AssetRecord(Frozen):
    """The result of one refinement. ``features``, ``guidance`` (what the prompt asks), ``overlay`` and ``measurement``
    are None where the stage was not reached."""

    ref: AssetRef
    category: str
    method: Method
    model: str
    status: Status
    failure_mode: FailureMode
    reason: str
    features: Features | None = None
    guidance: Guidance | None = None
    overlay: PhysicsOverlay | None = None
    measurement: Measurement | None = None
    reports: tuple[EngineReport, ...] = ()
    overlaps: tuple[OverlapPair, ...] = ()
    further: dict[str, int | float | str | None] = Field(default_factory=dict)
    alignment: Alignment | None = None
    expected: tuple[Expected, ...] = ()
    calls: tuple[ModelCall, ...] = ()
    trace: tuple[TraceStep, ...] = ()
    findings: tuple[Finding, ...] = ()
    seconds: dict[str, float] = Field(default_factory=dict)
    processor_s: dict[str, float] = Field(default_factory=dict)
    """Stage → its processor time, engines included, s; empty where the process died."""
    written: bool = False
    """Whether its refined folder was written; a stage that fails leaves none, and so does a method that writes none."""
    content_hash: str = ""
    """What the result depends on, as one value; empty until a run's plan fills it in."""


@dataclass(frozen=True, slots=True)
class MotionSummary:
    """The paper's tests in the engine that measured first; joints that oscillate by the run's thresholds."""

    penetration_m: float
    drift_m: float
    drift_rad: float
    finite: bool
    oscillating_joints: int


@dataclass(frozen=True, slots=True)
class AssetSummary:
    """One asset of a run. Fields of ``AssetRecord`` have its names; those of stages not reached are None.

    ``call_costs_usd`` has an entry per call not answered from the cache, as tokens count only those; ``engines`` is how
    many engines passed every check, and how many ran.
    """

    ref: AssetRef
    category: str
    method: Method
    model: str
    status: Status
    failure_mode: FailureMode
    reason: str
    content_hash: str
    seconds: Mapping[str, float]
    total_seconds: float
    call_costs_usd: tuple[float, ...]
    prompt_tokens: int
    completion_tokens: int
    cached_calls: int
    scale: float | None
    mass_kg: float | None
    measurement: MotionSummary | None
    alignment: Alignment | None
    expected: tuple[Expected, ...]
    engines: tuple[int, int] | None
    numbers: tuple[int, int, int] | None = None
    """Numbers of a file in metres that are kept, supplied and mended; None for other files."""

    @property
    def queries(self) -> int:
        """Model calls that were not answered from the cache."""
        return len(self.call_costs_usd)
