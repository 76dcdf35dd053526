"""One asset's job, and its run through the stages: wall and processor time, and what each leaves for its record."""

import os
import traceback
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import ParamSpec, TypeVar

from asset2sim.baselines.declared_method import known_methods
from asset2sim.intake.guessed_ends import ToldEnd
from asset2sim.models.ask_overlay import SynthesisError
from schemas.alignment import Alignment, Expected
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import AssetError, is_disk_full, shortened
from schemas.features import Features
from schemas.finding import Finding, TraceStep
from schemas.guidance import NOTHING_ASKED, Guidance
from schemas.interaction import EngineReport, OverlapPair
from schemas.model_names import is_prior
from schemas.overlay import PhysicsOverlay
from schemas.request import ModelAsk, ModelCall
from schemas.settings import Settings
from schemas.verdict import Verdict
from schemas.vocabulary import FailureMode, Severity, Source, Stage, Status


@dataclass(frozen=True, kw_only=True)
class StageResult:
    """Result that every stage may leave behind; what a stage makes is in the fields that its own result adds.

    A field that is None says nothing: what an earlier stage said of it stands.
    """

    findings: tuple[Finding, ...] = ()
    calls: tuple[ModelCall, ...] = ()
    trace: tuple[TraceStep, ...] = ()
    features: Features | None = None
    guidance: Guidance | None = None
    overlay: PhysicsOverlay | None = None
    reports: tuple[EngineReport, ...] | None = None
    overlaps: tuple[OverlapPair, ...] | None = None
    alignment: Alignment | None = None
    expected: tuple[Expected, ...] | None = None
    measure_s: float = 0.0
    """Of the stage's wall time, what engines took to verify, s: it counts as the stage ``measure``."""
    further: Mapping[str, int | float | str | None] = field(default_factory=dict)
    """Column of a further check → its value."""


Given = ParamSpec("Given")
Result = TypeVar("Result", bound=StageResult)


LEFT = ("features", "guidance", "overlay", "reports", "overlaps", "alignment", "expected")
"""Fields of a stage's result that stand in the asset's record as the last stage left them."""
READING = (Stage.EXTRACT, Stage.VALIDATE, Stage.APPLY)
"""Stages that work on the asset's own files and numbers alone: what they raise would come again every night."""
READING_ERRORS = (
    *(ArithmeticError, AssertionError, AttributeError, LookupError, RecursionError, TypeError, ValueError),
    *(PermissionError, FileNotFoundError, IsADirectoryError, NotADirectoryError),
)
"""What they raise because of the asset; other errors of the system may be gone tomorrow."""


def internal_error(stage: Stage, error: Exception) -> AssetError:
    """The unreadable_asset error for what a stage raised that is no finding of its own."""
    frames = traceback.extract_tb(error.__traceback__)
    own = next((frame for frame in reversed(frames) if "site-packages" not in frame.filename), frames[-1])
    text = shortened(" ".join(str(error).split()), 300)
    message = f"{stage.value} failed at something in it that is not foreseen: {type(error).__name__}: {text} "
    message += f"({own.name}, line {own.lineno}); its log has the details: mend the asset, or report this"
    return AssetError(FailureMode.UNREADABLE_ASSET, "internal_error", message)


@dataclass
class Progress:
    """Results of one asset's stages so far: if a later one fails, this still reaches the record."""

    features: Features | None = None
    guidance: Guidance | None = None
    overlay: PhysicsOverlay | None = None
    reports: tuple[EngineReport, ...] = ()
    overlaps: tuple[OverlapPair, ...] = ()
    alignment: Alignment | None = None
    expected: tuple[Expected, ...] = ()
    further: dict[str, int | float | str | None] = field(default_factory=dict)
    calls: list[ModelCall] = field(default_factory=list)
    trace: list[TraceStep] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    processor_s: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    stage: Stage = Stage.EXTRACT
    written: bool = False

    def run(
        self, stage: Stage, function: Callable[Given, Result], *args: Given.args, **options: Given.kwargs
    ) -> Result:
        """The stage's result, which is collected, as are its wall and processor time; raises what the stage raises, and
        as AssetError what stages raise that only read the asset."""
        self.stage, start, before = stage, perf_counter(), os.times()
        try:
            result = function(*args, **options)
        except READING_ERRORS as error:
            # What apply cannot open lies in the output, which the user may mend before the next run.
            writing = stage is Stage.APPLY and isinstance(error, OSError)
            if stage not in READING or writing or is_disk_full(error):
                raise
            traceback.print_exc()  # into the asset's log
            raise internal_error(stage, error) from error
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + perf_counter() - start
            now = os.times()
            self.processor_s[stage] += (now.user - before.user) + (now.system - before.system)
            # What refinement has children do is to measure.
            by = Stage.MEASURE if stage is Stage.REFINE else stage
            children_s = now.children_user - before.children_user, now.children_system - before.children_system
            self.processor_s[by] += sum(children_s)
        if result.measure_s:
            self.seconds[stage] -= result.measure_s
            self.seconds[Stage.MEASURE] = self.seconds.get(Stage.MEASURE, 0.0) + result.measure_s
        self.findings.extend(result.findings)
        self.calls.extend(result.calls)
        self.trace.extend(result.trace)
        self.further.update(result.further)
        for name in LEFT:
            if getattr(result, name) is not None:
                setattr(self, name, getattr(result, name))
        return result

    def failed(self, error: AssetError) -> Verdict:
        """The verdict where a stage raised; the error is kept as a finding of that stage."""
        if isinstance(error, SynthesisError):
            self.calls.extend(error.calls)
        self.findings.append(
            Finding(
                stage=self.stage,
                severity=Severity.ERROR,
                code=error.code,
                message=str(error),
                link=error.link,
                joint=error.joint,
            )
        )
        return Verdict(error.mode, str(error))

    def record(self, ref: AssetRef, settings: Settings, verdict: Verdict) -> AssetRecord:
        """Record of the asset, without its content hash, which the run's plan adds."""
        return AssetRecord(
            ref=ref,
            category=(self.features.category if self.features is not None else ref.category) or "",
            method=settings.method,
            model=settings.model.model,
            status=Status.OK if verdict.mode is FailureMode.NONE else Status.FAILED,
            failure_mode=verdict.mode,
            reason=verdict.reason,
            measurement=next((r.measurement for r in self.reports if r.measurement is not None), None),
            further=self.further,
            calls=tuple(self.calls),
            trace=tuple(step.model_copy(update={"step": index}) for index, step in enumerate(self.trace)),
            findings=tuple(self.findings),
            seconds=dict(self.seconds),
            processor_s=dict(self.processor_s),
            written=self.written,
            **{name: getattr(self, name) for name in LEFT},
        )


@dataclass(frozen=True)
class AssetJob:
    """One asset, the output folder, the run's settings, the one way to ask a model, and, once the asset is extracted,
    what its prompt asks of it and which closed ends a model told."""

    ref: AssetRef
    out: Path
    settings: Settings
    ask: ModelAsk
    guidance: Guidance = NOTHING_ASKED
    closed_ends: Mapping[str, ToldEnd] = field(default_factory=dict)

    @property
    def source(self) -> Source:
        """Source of the numbers that the method proposes: an expert, a rule, a prior or a model."""
        stated = known_methods()[self.settings.method].source
        return stated or (Source.PRIOR if is_prior(self.settings.model.model) else Source.MODEL)
