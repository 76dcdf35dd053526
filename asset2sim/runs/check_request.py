"""Checking that a run can start as requested, before anything is written, and the yardsticks of its assets: experts'
choices (paper, evaluation, section 2) and readers' expectations."""

import csv
import math
import os
import socket
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import cast
from urllib.parse import urlsplit

from asset2sim.checks.alignment import expectations as expected
from asset2sim.checks.declared_check import require_bounds
from asset2sim.engines.registry import require
from asset2sim.experiments.isolation import Ending
from asset2sim.experiments.isolation.supervise import Work, in_child
from asset2sim.intake.asset_folders import refuse_twice
from asset2sim.intake.dataset import load_dataset
from asset2sim.intake.overrides import with_prompt
from asset2sim.intake.scenes import with_parts
from asset2sim.intake.url_files import local_file
from asset2sim.models.gateway.abilities import check_model
from schemas.alignment import Reference
from schemas.asset import AssetRef, FoundAssets
from schemas.errors import Mistakes, UsageError
from schemas.inputs import InputSettings
from schemas.location import Location, nearest_existing
from schemas.secret import redacted_address
from schemas.settings import Settings

CUT_LIMIT_S = 120.0
"""Time in which a scene must be read, s: a kitchen of 34 bodies takes one."""
CONNECT_LIMIT_S = 5.0
"""Time in which a scheduler must accept a connection, s."""


def check_request(
    data: Path | str,
    out: Path | str,
    settings: Settings,
    subset: str | None,
    asset_ids: Sequence[str],
    limit: int | None,
) -> FoundAssets:
    """The assets to refine, as ``load_dataset`` has them. Raises ``UsageError`` for what cannot be done as asked."""
    found, mistakes = FoundAssets([]), Mistakes()
    with mistakes:
        refs = load_dataset(data, subset, asset_ids, limit, partial(cut_scenes, inputs=settings.inputs))
        found = FoundAssets(with_prompt(refs, settings.prompt))
    with mistakes:
        check_run(found, data, out, settings)
    mistakes.end()
    return found


def cut_scenes(refs: list[AssetRef], inputs: InputSettings) -> list[AssetRef]:
    """The assets, scenes among them cut where ``inputs`` ask for it, each in a child process: one that dies of a file
    leaves that as it is, to fail as an asset."""
    if not inputs.split:
        return refs
    found = list[AssetRef]()
    for ref in refs:
        if Location(ref.path).is_url:
            raise UsageError(f"--split: {ref.path} is behind a URL; bring the scene to this machine")
        outcome = in_child(Work(with_parts, ([ref], inputs), CUT_LIMIT_S))
        found += cast(list[AssetRef], outcome.value) if outcome.ending is Ending.RETURNED else [ref]
    refuse_twice((ref.asset_id for ref in found), "--split")
    return found


def check_run(found: FoundAssets, data: Path | str, out: Path | str, settings: Settings) -> None:
    """Raise ``UsageError`` where these assets cannot be refined into ``out`` with these settings, with all reasons."""
    mistakes, place = Mistakes(), Location(out).absolute()
    with mistakes:
        check_model(settings.model)
    with mistakes:
        check_packages(settings.inputs.package_folders, Location(data))
    for engine in settings.engine.verify or ():
        with mistakes:
            require(engine)
    with mistakes:
        if settings.thresholds.further:
            require_bounds(settings.thresholds)
    with mistakes:
        if settings.exports:
            from asset2sim.assets.exports import require_exports  # late: it brings an engine and a second of imports

            require_exports(settings.exports)
    with mistakes:
        if settings.run.scheduler is not None:
            check_scheduler(settings.run.scheduler)
    with mistakes:
        if settings.run.hook is not None and is_web_address(settings.run.hook):
            # The shell would print it, key and all, as a command that it does not find.
            raise UsageError(
                "--hook is a web address, not a command; call it, as in --hook 'curl -d \"$FAILED\" https://…'"
            )
    with mistakes:
        check_output(place, Location(data).absolute(), found.refs)
    with mistakes:
        if place.is_url:
            if settings.inputs.split:
                raise UsageError("--split needs an --out that is a folder, in which scenes are put together")
            from asset2sim.runs.remote.output import check_store  # late: it brings the tables

            check_store(place)
    mistakes.end()


def is_web_address(command: str) -> bool:
    """Whether a shell command is nothing but a web address."""
    words = command.split()
    return len(words) == 1 and words[0].lower().startswith(("http://", "https://"))


def check_packages(folders: Mapping[str, str], data: Location) -> None:
    """Refuse a package whose folder is not there, or is a URL that does not lie beside the dataset's."""
    for name, place in folders.items():
        folder = Location(place)
        if not folder.is_url and not folder.folder.is_dir():
            raise UsageError(
                f"--package {name}={place}: there is no such folder; name the one that '{name}/' stands for"
            )
        if folder.is_url and (not data.is_url or folder.split("/")[:3] != data.split("/")[:3]):
            raise UsageError(f"--package {name}={place}: a package behind a URL lies in the bucket of its dataset")


def check_scheduler(address: str) -> None:
    """Refuse the address of a Dask scheduler at which nothing listens, or one with more than host and port, which might
    be a key and would be printed and kept."""
    parts = urlsplit(address)
    try:
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    plain = parts.scheme in ("tcp", "tls") and address.rstrip("/") == f"{parts.scheme}://{parts.netloc}"
    if not plain or host is None or port is None or "@" in parts.netloc:
        where = redacted_address(address)
        raise UsageError(f"--scheduler {where}: write it as tcp://host:port, as `dask scheduler` prints it")
    try:
        with socket.create_connection((host, port), timeout=CONNECT_LIMIT_S):
            return
    except OSError as error:
        raise UsageError(
            f"no Dask scheduler listens at {address} ({error}); start one with `dask scheduler`, or leave "
            "--scheduler out"
        ) from error


def check_output(out: Location, data: Location, refs: Sequence[AssetRef]) -> None:
    """Refuse an output (absolute) that is the input or part of it, or that cannot be written to."""
    if out == data:
        raise UsageError(f"--out {out} is the dataset itself, which is never written to; choose another folder")
    for ref in refs:
        source = Location(ref.path)
        if out.is_within(source) or source.is_within(out.below("assets")):
            raise UsageError(f"--out {out} and asset {ref.asset_id} at {source} overlap; choose another --out")
    if out.is_url:
        return
    if out.folder.exists() and not out.folder.is_dir():
        raise UsageError(f"--out {out} is a file; name a folder")
    above = nearest_existing(out.folder)
    if not os.access(above, os.W_OK | os.X_OK):
        raise UsageError(f"--out {out}: {above} is not writable; choose another folder")


@dataclass(frozen=True)
class Yardsticks:
    """Assets with the yardsticks of their dataset, and all of its expectations, those of no asset among them."""

    refs: list[AssetRef]
    expectations: expected.Expectations

    def unknown(self, present: Collection[str] | None) -> tuple[str, ...]:
        """A sentence for every expectation of an asset that is not ``present``; none where that is not known."""
        return () if present is None else expected.unknown_assets(self.expectations, present)


def with_yardsticks(data: Location, refs: Sequence[AssetRef]) -> Yardsticks:
    """The assets with what the dataset's files say of each. Raises UsageError for a file that is no such table."""
    references = read_references(local_file(data.below(FILE)))
    expectations = expected.read_expectations(local_file(data.below(expected.FILE)))
    held = [
        ref.model_copy(
            update={"reference": references.get(ref.asset_id), "expectations": expectations.get(ref.asset_id, ())}
        )
        for ref in refs
    ]
    return Yardsticks(held, expectations)


FILE = "reference.csv"
COLUMNS = ("asset_id", "gensim2_task", "scale", "joint", "joint_position")
NOT_ARTICULATING = ("_move", "_lift")
"""Endings of tasks that carry the whole object: where there is another task, that one states the joint of interest."""


def read_references(file: Path) -> dict[str, Reference]:
    """Asset id → its reference; of several tasks the one that articulates the object. Empty where there is no file.
    Raises UsageError where the file is there and cannot be read as such a table."""
    if not file.is_file():
        return {}
    try:
        with file.open(encoding="utf-8-sig", newline="") as stream:
            rows = list(csv.DictReader(stream))
        # Tasks that articulate come last, so that they replace those that carry.
        rows.sort(key=lambda row: not row["gensim2_task"].endswith(NOT_ARTICULATING))
        return {row["asset_id"]: _reference(row) for row in rows}
    except (KeyError, ValueError, AttributeError, TypeError, csv.Error) as error:
        raise UsageError(f"{file}: not a table with the columns {', '.join(COLUMNS)} ({error!r})") from error


def _reference(row: dict[str, str]) -> Reference:
    found = Reference(float(row["scale"]), row["joint"], float(row["joint_position"]))
    if not (math.isfinite(found.scale) and found.scale > 0.0 and math.isfinite(found.position)):
        raise ValueError(f"asset {row['asset_id']}: scale {found.scale}, joint position {found.position}")
    return found
