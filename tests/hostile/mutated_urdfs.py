"""Mutated URDFs through reading, extraction and validation, and some through the whole refinement: a row for each.

`python -m tests.hostile.mutated_urdfs OUT [--count 5000] [--whole 50] [--seed 1] [--first 0] [--jobs 2]`
"""

import argparse
import json
import pkgutil
import shutil
import sys
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from queue import Queue
from random import Random

from asset2sim.baselines.ours import by_rules
from asset2sim.models.prior.answer import answer
from asset2sim.runs.asset_attempt import attempt_in_child
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import AssetError
from schemas.request import ModelAnswer, ModelAsk, ModelRequest
from schemas.settings import EngineSettings, RunSettings, Settings, ViewSettings
from schemas.vocabulary import Engine, FailureMode, Severity, Stage
from tests.hostile.urdf_mutations import mutant
from tests.samples.sample_dataset import sample_files

VALIDATED = "tests.hostile.mutated_urdfs:validated"
REFINED = "tasks.pipeline:refine_asset"
SETTINGS = Settings(
    views=ViewSettings(write=False),
    engine=EngineSettings(verify=(Engine.PYBULLET,), interact=False),
    run=RunSettings(asset_memory_limit_mb=3072),
)
"""One engine and no pictures: what is tried is what the numbers do, not what engines make of them. The time limit is a
run's own."""
PLANTED = "planted_"
CRASHES = (FailureMode.ENGINE_REFUSED, FailureMode.ENGINE_CRASH, FailureMode.TIMEOUT, FailureMode.DISK_FULL)
SECRET = "o secret\n" + "".join(f"v {x} {y} {z}\n" for x in (0, 7) for y in (0, 7) for z in (0, 7)) + "f 1 2 4 3\n" * 4
"""A mesh outside the dataset, 7 m large, which no asset may have read."""


@dataclass(frozen=True)
class Result:
    """What became of one mutant: its record's failure mode and code (empty where it is well), and why the row is not a
    clean one, empty where it is."""

    index: int
    sample: str
    mutations: tuple[str, ...]
    mode: str
    code: str
    problem: str
    seconds: float


def ask(request: ModelRequest) -> ModelAnswer:
    """``prior/household``, without the gateway."""
    return ModelAnswer(content=answer(request.text), calls=())


def validated(ref: AssetRef, out: Path, settings: Settings, ask: ModelAsk) -> AssetRecord:
    """The record of an asset after its first three stages, which no engine takes part in."""
    # By name, since no room of asset2sim may import the stages.
    job = pkgutil.resolve_name("tasks.progress:AssetJob")(ref, out, settings, ask)
    progress = pkgutil.resolve_name("tasks.progress:Progress")()
    extract, propose, validate = (
        pkgutil.resolve_name(f"tasks.{name}")
        for name in ("extract:extract_asset", "synthesize:with_users_numbers", "validate:validate_overlay")
    )
    verdict = pkgutil.resolve_name("asset2sim.checks.verdict:Verdict")(FailureMode.NONE, "")
    try:
        extracted = progress.run(Stage.EXTRACT, extract, job, correct_joints=True)
        job, extraction = replace(job, guidance=extracted.guidance), extracted.extraction
        proposal = progress.run(Stage.SYNTHESIZE, propose, by_rules, job, extraction).proposal
        progress.run(Stage.VALIDATE, validate, job, extraction, proposal, rules=True)
    except AssetError as error:
        verdict = progress.failed(error)
    record: AssetRecord = progress.record(ref, settings, verdict)
    return record


def unclean(record: AssetRecord) -> str:
    """Why a record is no clean row, in words; empty where it is one."""
    errors = [finding for finding in record.findings if finding.severity is Severity.ERROR]
    if record.failure_mode in CRASHES:
        return record.reason
    if any(finding.code == "internal_error" for finding in record.findings):
        return next(finding.message for finding in record.findings if finding.code == "internal_error")
    if record.failure_mode is not FailureMode.NONE and not record.reason:
        return "it failed without a reason"
    if any("Traceback" in finding.message or len(finding.message) > 2000 for finding in errors):
        return f"a message is no sentence: {errors[0].message[:200]}"
    try:
        if AssetRecord.model_validate_json(record.model_dump_json()) != record:
            return "its record is another one after it was written and read"
    except ValueError as error:
        return f"its record cannot be read again: {' '.join(str(error).split())[:300]}"
    if record.features is not None and max(link.area_m2 for link in record.features.links) == 7.0 * 7.0:
        return "the mesh outside was read"
    return ""


@dataclass(frozen=True)
class Bench:
    """A folder to work in, the samples' files by name, and the seed."""

    out: Path
    samples: dict[str, dict[str, bytes]]
    seed: int

    def lay(self, place: Path, index: int) -> tuple[AssetRef, tuple[str, ...]]:
        """Write one mutant into ``place``, and name its mutations."""
        rng = Random(f"{self.seed} {index}")
        name = rng.choice(sorted(self.samples))
        files = self.samples[name]
        folder = place / "data" / name
        for path, data in files.items():
            if not (folder / path).is_file():
                (folder / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / path).write_bytes(data)
        outside = place / "outside" / "secret.obj"
        outside.parent.mkdir(exist_ok=True)
        outside.write_text(SECRET)
        changed, mutations = mutant(files["mobility.urdf"], rng)
        (folder / "mobility.urdf").write_bytes(changed.replace(b"{outside}", str(outside.parent).encode()))
        return AssetRef(asset_id=name, path=str(folder)), mutations

    def tried(self, places: "Queue[Path]", pipeline: str, index: int) -> Result:
        """What became of one mutant; one that is not clean is kept in ``unclean``."""
        place = places.get()
        try:
            ref, mutations = self.lay(place, index)
            record = attempt_in_child(pipeline, ref, place / "out", SETTINGS, ask).record
            problem = unclean(record) or smuggled(place)
            code = next((item.code for item in record.findings if item.severity is Severity.ERROR), "")
            mode, seconds = record.failure_mode.value, sum(record.seconds.values())
            if problem:
                kept = self.out / "unclean" / f"{index}.urdf"
                kept.parent.mkdir(exist_ok=True)
                shutil.copyfile(Path(ref.path) / "mobility.urdf", kept)
            result = Result(index, ref.asset_id, mutations, mode, code, problem, seconds)
            with (self.out / done_file(pipeline)).open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(vars(result)) + "\n")
            return result
        finally:
            places.put(place)

    def run(self, indices: Sequence[int], pipeline: str, jobs: int) -> list[Result]:
        """What became of these mutants, ``jobs`` at a time; those that an interrupted run has tried are not tried
        again."""
        done = {item.index: item for item in results_in(self.out / done_file(pipeline))}
        places: Queue[Path] = Queue()
        for number in range(jobs):
            place = self.out / f"work-{number}"
            place.mkdir(parents=True, exist_ok=True)
            places.put(place)
        with ThreadPoolExecutor(jobs) as pool:
            left = [index for index in indices if index not in done]
            done |= {item.index: item for item in pool.map(partial(self.tried, places, pipeline), left)}
        return [done[index] for index in indices]


def done_file(pipeline: str) -> str:
    """Name of the file with a line for each mutant that went through a pipeline."""
    return f"{pipeline.rpartition(':')[2]}.jsonl"


def results_in(file: Path) -> list[Result]:
    """The results that an earlier run has left."""
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    return [Result(**{**item, "mutations": tuple(item["mutations"])}) for item in map(json.loads, lines)]


def smuggled(place: Path) -> str:
    """Where the mesh outside has come into the output, in words; empty where it has not."""
    found = [
        path for path in (place / "out" / "assets").rglob("*") if path.is_file() and b"o secret" in path.read_bytes()
    ]
    return f"{found[0]} came from outside" if found else ""


def bench_of(out: Path, seed: int) -> Bench:
    """A bench over the well-made objects of the sample dataset."""
    samples: dict[str, dict[str, bytes]] = {}
    for path, data in sample_files().items():
        parts = Path(path).parts
        if len(parts) > 2 and not parts[1].startswith(PLANTED):
            samples.setdefault(parts[1], {})["/".join(parts[2:])] = data
    return Bench(out, samples, seed)


def report(results: Sequence[Result]) -> str:
    """The outcomes counted, and every row that is not clean, in Markdown."""
    counts = Counter((result.mode, result.code) for result in results)
    lines = ["| outcome | code | mutants |", "| --- | --- | ---: |"]
    lines += [f"| {mode} | {code} | {count} |" for (mode, code), count in counts.most_common()]
    bad = [result for result in results if result.problem]
    slowest = max((result.seconds for result in results), default=0.0)
    lines += ["", f"{len(results)} mutants, {len(bad)} without a clean row; the slowest took {slowest:.1f} s."]
    lines += [f"- {item.index} ({item.sample}: {', '.join(item.mutations)}): {item.problem}" for item in bad]
    return "\n".join(lines) + "\n"


def main(words: Sequence[str] | None = None) -> int:
    """Try the mutants, write ``OUT/mutated.md``, and a line for each as it is done; 1 where a row is not clean."""
    parser = argparse.ArgumentParser(prog="python -m tests.hostile.mutated_urdfs", description=__doc__)
    parser.add_argument("out", type=Path)
    for name, default in (("count", 5000), ("whole", 50), ("seed", 1), ("first", 0), ("jobs", 2)):
        parser.add_argument(f"--{name}", type=int, default=default)
    given = parser.parse_args(words)
    given.out.mkdir(parents=True, exist_ok=True)
    bench = bench_of(given.out, given.seed)
    results = bench.run(range(given.first, given.first + given.count), VALIDATED, given.jobs)
    results += bench.run(range(given.first, given.first + given.whole), REFINED, given.jobs)
    (given.out / "mutated.md").write_text(report(results), encoding="utf-8")
    sys.stdout.write(report(results))
    return int(any(result.problem for result in results))


if __name__ == "__main__":
    raise SystemExit(main())
