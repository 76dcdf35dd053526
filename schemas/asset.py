"""One asset to refine, and its result record, as sent between the flow and the workers."""

import json
from collections.abc import Sequence

from pydantic import Field

from schemas.alignment import Alignment, Expectation, Expected, Reference
from schemas.base import Frozen
from schemas.features import Features
from schemas.finding import Finding, TraceStep
from schemas.guidance import Guidance
from schemas.interaction import EngineReport, Measurement, OverlapPair
from schemas.overlay import PhysicsOverlay
from schemas.overrides import Overrides
from schemas.request import ModelCall
from schemas.support import SupportKind
from schemas.vocabulary import FailureMode, Method, Status, UpAxis


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
