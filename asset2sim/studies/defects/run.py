"""Runs the bench: refine clean objects, plant each defect in a copy, check the copy unrefined, and refine it."""

import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from asset2sim.models.prior.answer import answer
from asset2sim.runs.dataset import load_dataset
from asset2sim.runs.isolation.asset_attempt import attempt_in_child
from asset2sim.studies.defects.planted import Defect, RefinedAsset
from asset2sim.studies.defects.score import Row, Sign, caught_by, concerned, early_signs, mended_by, raw_signs
from asset2sim.studies.samples.dataset import sample_files
from schemas.asset import AssetRecord, AssetRef
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import Settings, ViewSettings
from schemas.vocabulary import Method, Status

PIPELINE = "tasks.pipeline:refine_asset"
SETTINGS = Settings(views=ViewSettings(write=False))
"""The default settings, without pictures."""


@dataclass(frozen=True)
class CleanObject:
    """One clean object: its refinement, and the signs from checking and refining the result again.

    ``problem`` says why it is not clean: a planted defect could not be told from its own defects.
    """

    ref: AssetRef
    kept: RefinedAsset
    signs: frozenset[Sign]
    again: AssetRecord | None
    problem: str


def ask(request: ModelRequest) -> ModelAnswer:
    """The offline prior, without the gateway: nothing here is counted or cached."""
    return ModelAnswer(content=answer(request.text), calls=())


def refined(ref: AssetRef, out: Path, settings: Settings) -> AssetRecord:
    """The record of one asset by the pipeline, run in a child process."""
    return attempt_in_child(PIPELINE, ref, out, settings, ask).record


def samples(out: Path, wanted: Iterable[str]) -> list[AssetRef]:
    """The sample objects of these ids, written under ``out``; without prompts, so that they start closed."""
    for name, data in sample_files().items():
        path = out / "samples" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    found = load_dataset(out / "samples", None, tuple(sorted(wanted)), None)
    return [ref.model_copy(update={"prompt": None}) for ref in found]


def judged(ref: AssetRef, out: Path, settings: Settings) -> AssetRecord:
    """The record of one asset, checked without refinement."""
    return refined(ref, out, settings.model_copy(update={"method": Method.RAW}))


def clean_object(ref: AssetRef, out: Path, settings: Settings) -> CleanObject:
    """Refine a sample, then check the result without refinement, and refine it again."""
    record = refined(ref, out / "clean", settings)
    kept = RefinedAsset(out / "clean" / "assets" / ref.asset_id, record)
    if record.status is not Status.OK:
        return CleanObject(ref, kept, frozenset(), None, f"refined, it fails: {record.reason}")
    as_it_is = ref.model_copy(update={"path": str(kept.folder)})
    raw = judged(as_it_is, out / "clean_raw", settings)
    if raw.status is not Status.OK:
        return CleanObject(ref, kept, frozenset(), None, f"judged as refined, it fails: {raw.reason}")
    again = refined(as_it_is, out / "clean_again", settings)
    if again.status is not Status.OK:
        return CleanObject(ref, kept, frozenset(), None, f"refined twice, it fails: {again.reason}")
    signs = frozenset([*raw_signs(raw, settings.thresholds), *early_signs(again)])
    return CleanObject(ref, kept, signs, again, "")


def try_defect(defect: Defect, clean: CleanObject, out: Path, settings: Settings) -> Row:
    """Plant one defect in a copy of its clean object, and see whether it is caught and mended."""
    start = perf_counter()
    name = "".join(letter if letter.isalnum() else "_" for letter in defect.name)
    folder = out / "planted" / name / clean.ref.asset_id
    shutil.copytree(clean.kept.folder, folder, dirs_exist_ok=True)
    planted = defect.plant(folder, defect.target)
    about = concerned(planted, clean.kept.record)
    ref = clean.ref.model_copy(update={"path": str(folder)})
    raw = judged(ref, out / "judged" / name, settings)
    mended = refined(ref, out / "mended" / name, settings)
    signs = {*raw_signs(raw, settings.thresholds), *early_signs(mended)}
    caught = tuple(dict.fromkeys(sign.said for sign in caught_by(signs, set(clean.signs), about)))
    left = why_not_mended(defect, clean, RefinedAsset(out / "mended" / name / "assets" / ref.asset_id, mended))
    by = mended_by(mended, clean.again or clean.kept.record, about) if not left else ()
    return Row(defect.name, ref.asset_id, planted.what, caught, by, left, perf_counter() - start)


def why_not_mended(defect: Defect, clean: CleanObject, mended: RefinedAsset) -> str:
    """Why a defect does not count as mended, or an empty text."""
    if mended.record.status is not Status.OK:
        return f"{mended.record.failure_mode.value}: {mended.record.reason}"
    try:
        return defect.left(clean.kept, mended, defect.target)
    except KeyError as error:
        return f"not there any more: {error.args[0]}"


def run(
    defects: Sequence[Defect], out: Path, settings: Settings, tell: Callable[[str], None]
) -> tuple[list[Row], dict[str, str]]:
    """A row a defect, in their order, and the unclean objects with the reason; ``tell`` gets lines of progress."""
    wanted = {defect.target.asset_id for defect in defects}
    with ThreadPoolExecutor(settings.run.workers) as pool:
        clean: dict[str, CleanObject] = {}
        for item in pool.map(lambda ref: clean_object(ref, out, settings), samples(out, wanted)):
            clean[item.ref.asset_id] = item
            tell(f"{item.ref.asset_id}: {item.problem or 'clean'}")
        rows = list(
            progress(
                pool.map(
                    lambda defect: try_defect(defect, clean[defect.target.asset_id], out, settings),
                    [defect for defect in defects if not clean[defect.target.asset_id].problem],
                ),
                tell,
            )
        )
    return rows, {name: item.problem for name, item in clean.items() if item.problem}


def progress(rows: Iterator[Row], tell: Callable[[str], None]) -> Iterator[Row]:
    """The rows, with a line of progress for each."""
    for row in rows:
        tell(f"{row.defect}: {'caught' if row.is_caught else 'NOT CAUGHT'}, {'mended' if row.is_mended else row.left}")
        yield row
