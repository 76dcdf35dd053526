"""The sample dataset: its assets, their files, and writing them to disk, to data/raw unless told otherwise:
``python -m tests.samples.sample_dataset [OUT]``."""

import csv
import io
import shutil
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from pydantic import Field
from pydantic_settings import CliPositionalArg

from asset2sim.intake.dataset import MANIFEST
from asset2sim.runs.command_line import Options, parse
from schemas.errors import UsageError
from tests.samples.bad_assets import bad_assets
from tests.samples.blueprint import Blueprint
from tests.samples.layout import asset_files
from tests.samples.objects import bags, boxes, devices, furniture, tools, vessels

SAMPLES: tuple[Callable[[], Blueprint], ...] = (
    tools.stapler, boxes.wooden_box, boxes.treasure_chest, devices.microwave, vessels.toilet, devices.laptop,
    bags.handbag, bags.business_suitcase, furniture.desk_cabinet, furniture.sideboard, vessels.trash_can,
    vessels.bucket, tools.scissors, furniture.folding_chair, devices.keyboard,
)  # fmt: skip
"""The good objects, in the manifest's order."""

SUBSETS = frozenset({"sample", "planted"})


def blueprints() -> tuple[Blueprint, ...]:
    """Every asset's blueprint, the good ones first."""
    return tuple(make() for make in SAMPLES) + tuple(bad.blueprint for bad in bad_assets())


def sample_files() -> dict[str, bytes]:
    """The whole dataset: a path relative to its root, with forward slashes → the file's bytes."""
    good = [make() for make in SAMPLES]
    made = [(blueprint, asset_files(blueprint)) for blueprint in good]
    made += [(bad.blueprint, bad.files()) for bad in bad_assets()]
    files = {f"{_folder(blueprint)}/{name}": data for blueprint, contents in made for name, data in contents.items()}
    return {MANIFEST: _manifest([blueprint for blueprint, _ in made]), **files}


def write_samples(out: Path) -> list[str]:
    """Write the dataset to ``out``, replacing an earlier one, and return its asset ids in order. Everything is written
    beside ``out`` and moved there at the end, so that a failed run leaves the last good one. Raises UsageError where
    ``out`` holds anything but an earlier sample dataset."""
    target = out.resolve()
    _check_replaceable(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    staging = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
    try:
        fresh, stale = staging / "fresh", staging / "stale"
        fresh.mkdir()
        for name, data in sample_files().items():
            path = fresh / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        if target.exists():
            target.rename(stale)
        try:
            fresh.rename(target)
        except BaseException:
            if stale.exists():
                stale.rename(target)
            raise
    finally:
        shutil.rmtree(staging, ignore_errors=True)
    return [blueprint.asset_id for blueprint in blueprints()]


def _folder(blueprint: Blueprint) -> str:
    return f"{blueprint.category}/{blueprint.asset_id}"


def _manifest(made: list[Blueprint]) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("asset_id", "category", "path", "subset", "prompt"))
    writer.writerows([b.asset_id, b.category, _folder(b), b.subset, b.prompt] for b in made)
    return text.getvalue().encode()


def _check_replaceable(target: Path) -> None:
    # The folder is replaced as a whole: never do that to one that is not ours.
    if not target.exists() or (target.is_dir() and not any(target.iterdir())):
        return
    manifest = target / MANIFEST
    if target.is_dir() and manifest.is_file():
        with manifest.open(newline="", encoding="utf-8", errors="replace") as file:
            found = {row.get("subset") for row in csv.DictReader(file)}
        if found and found <= SUBSETS:
            return
    raise UsageError(
        f"{target} is not an earlier sample dataset; name an empty or a new folder to write the samples to"
    )


class SampleOptions(Options):
    """Write the sample dataset."""

    out: CliPositionalArg[Path] = Field(Path("data/raw"), description="folder to write")


def main(words: Sequence[str]) -> int:
    """Write the samples; exit code 2 where the folder named holds something else."""
    try:
        out = parse(SampleOptions, words, "python -m tests.samples.sample_dataset").out
        written = write_samples(out)
    except UsageError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    sys.stdout.write(f"{len(written)} assets written to {out}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
