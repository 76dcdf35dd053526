"""Runs the bench: refine clean objects, plant each defect in a copy, check the copy unrefined, and refine it."""

import shutil
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from asset2sim.intake.dataset import load_dataset
from asset2sim.models.prior.answer import answer
from asset2sim.runs.asset_attempt import attempt_in_child
from lab.defects.defect_results import (
    DefectResult,
    Symptom,
    caught_by,
    concerned,
    early_symptoms,
    mended_by,
    raw_symptoms,
)
from lab.defects.planting import Defect, RefinedAsset
from schemas.asset import AssetRecord, AssetRef
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import MethodSettings, Settings, ViewSettings
from schemas.vocabulary import Method, Status

SAMPLES = Path(__file__).parents[2] / "data" / "raw"
"""The checkout's sample dataset, which holds the clean objects."""
SETTINGS = Settings(views=ViewSettings(write=False), methods=MethodSettings(raw_asked=True))
"""The default settings, without pictures; what was refined is asked to stay as it is."""


@dataclass(frozen=True)
class CleanObject:
    """One clean object: its refinement, and the symptoms from checking and refining the result again. ``problem`` says
    why it is not clean: a planted defect could not be told from its own defects."""

    ref: AssetRef
    kept: RefinedAsset
    symptoms: frozenset[Symptom]
    again: AssetRecord | None
    problem: str


def ask(request: ModelRequest) -> ModelAnswer:
    """``prior/household``, without the gateway: nothing here is counted or cached."""
    return ModelAnswer(content=answer(request.text), calls=())


@dataclass(frozen=True)
class DefectBench:
    """Where the bench works, with which settings, and the pipeline's ``module:function`` name, run in children."""

    out: Path
    settings: Settings
    pipeline: str

    def refine(self, ref: AssetRef, folder: str, method: Method | None = None) -> RefinedAsset:
        """One asset refined into a folder below ``out``, by a method other than the settings' where one is given."""
        settings = self.settings.model_copy(update={"method": method} if method else {})
        record = attempt_in_child(self.pipeline, ref, self.out / folder, settings, ask).record
        return RefinedAsset(self.out / folder / "assets" / ref.asset_id, record)

    def check_unrefined(self, ref: AssetRef, folder: str) -> AssetRecord:
        """The record of one asset, checked without refinement."""
        return self.refine(ref, folder, Method.RAW).record


def samples(wanted: Iterable[str]) -> list[AssetRef]:
    """The checkout's sample objects of these ids; without prompts, so that they start closed."""
    found = load_dataset(SAMPLES, None, tuple(sorted(wanted)), None)
    return [ref.model_copy(update={"prompt": None}) for ref in found]


def clean_object(ref: AssetRef, bench: DefectBench) -> CleanObject:
    """Refine a sample, then check the result without refinement, and refine it again."""
    kept = bench.refine(ref, "clean")

    def unclean(how: str, record: AssetRecord) -> CleanObject:
        return CleanObject(ref, kept, frozenset(), None, f"{how}, it fails: {record.reason}")

    if kept.record.status is not Status.OK:
        return unclean("refined", kept.record)
    as_it_is = ref.model_copy(update={"path": str(kept.folder), "root": None})
    raw = bench.check_unrefined(as_it_is, "clean_raw")
    if raw.status is not Status.OK:
        return unclean("checked as refined", raw)
    again = bench.refine(as_it_is, "clean_again").record
    if again.status is not Status.OK:
        return unclean("refined twice", again)
    symptoms = frozenset([*raw_symptoms(raw, bench.settings.thresholds), *early_symptoms(again)])
    return CleanObject(ref, kept, symptoms, again, "")


def try_defect(defect: Defect, clean: CleanObject, bench: DefectBench) -> DefectResult:
    """Plant one defect in a copy of its clean object, and see whether it is caught and mended."""
    start = perf_counter()
    name = "".join(letter if letter.isalnum() else "_" for letter in defect.name)
    folder = bench.out / "planted" / name / clean.ref.asset_id
    shutil.copytree(clean.kept.folder, folder, dirs_exist_ok=True)
    planted = defect.plant(folder, defect.target)
    about = concerned(planted, clean.kept.record)
    ref = clean.ref.model_copy(update={"path": str(folder), "root": None})
    raw = bench.check_unrefined(ref, f"unrefined/{name}")
    mended = bench.refine(ref, f"mended/{name}")
    symptoms = {*raw_symptoms(raw, bench.settings.thresholds), *early_symptoms(mended.record)}
    caught = tuple(dict.fromkeys(symptom.said for symptom in caught_by(symptoms, set(clean.symptoms), about)))
    left = why_not_mended(defect, clean, mended)
    by = mended_by(mended.record, clean.again or clean.kept.record, about) if not left else ()
    return DefectResult(defect.name, ref.asset_id, planted.what, caught, by, left, perf_counter() - start)


def why_not_mended(defect: Defect, clean: CleanObject, mended: RefinedAsset) -> str:
    """Why a defect does not count as mended, or an empty text."""
    if mended.record.status is not Status.OK:
        return f"{mended.record.failure_mode.value}: {mended.record.reason}"
    try:
        return defect.left(clean.kept, mended, defect.target)
    except KeyError as error:
        return f"not there any more: {error.args[0]}"
    except ValueError as error:
        return f"what was written cannot be read: {error}"


def try_defects(
    defects: Sequence[Defect], bench: DefectBench, tell: Callable[[str], None]
) -> tuple[list[DefectResult], dict[str, str]]:
    """A result a defect, in their order, and the unclean objects with the reason; ``tell`` gets lines of progress."""
    wanted = {defect.target.asset_id for defect in defects}
    clean: dict[str, CleanObject] = {}
    with ThreadPoolExecutor(bench.settings.run.workers) as pool:
        for item in pool.map(lambda ref: clean_object(ref, bench), samples(wanted)):
            clean[item.ref.asset_id] = item
            tell(f"{item.ref.asset_id}: {item.problem or 'clean'}")
        tried = [defect for defect in defects if not clean[defect.target.asset_id].problem]
        rows = []
        for row in pool.map(lambda defect: try_defect(defect, clean[defect.target.asset_id], bench), tried):
            said = "mended" if row.is_mended else row.left
            tell(f"{row.defect}: {'caught' if row.is_caught else 'NOT CAUGHT'}, {said}")
            rows.append(row)
    return rows, {name: item.problem for name, item in clean.items() if item.problem}
