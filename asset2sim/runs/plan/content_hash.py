"""Content hash of an asset: everything that its result depends on, the code and the packages' versions included."""

import ast
import functools
import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib import metadata
from pathlib import Path

from asset2sim.engines.registry import installed
from asset2sim.guidance.csv_rows import LEFT_OUT_VARIABLE
from schemas.asset import AssetRef
from schemas.declared import outside_code
from schemas.settings import EngineSettings, Settings
from schemas.vocabulary import DECIDING_PACKAGES, Check, Engine

CHECKOUT = Path(__file__).resolve().parents[3]
ROOMS = (
    *("schemas", "tasks", "asset2sim/guidance", "asset2sim/render", "lab/noise"),
    *("asset2sim/physics", "asset2sim/assets", "asset2sim/models", "asset2sim/validation", "asset2sim/engines"),
    *("asset2sim/checks", "asset2sim/refinement", "asset2sim/baselines"),
    # An asset's rows, and the records of those that fail outside the pipeline.
    *("asset2sim/catalog/rows.py", "asset2sim/catalog/rows_engines.py", "asset2sim/catalog/summarize.py"),
    *("asset2sim/experiments/isolation", "asset2sim/runs/asset_attempt.py"),
    *("asset2sim/runs/remote/fetch_asset.py", "asset2sim/runs/spread/worker.py"),
)
"""Folders and modules, relative to the checkout, that decide an asset's result or its rows."""
ROOMS_OF_CHECKS: Mapping[Check, Sequence[str]] = {
    Check.REACHABLE: ("lab/trials", "lab/schemas", "asset2sim/gym/arm", "asset2sim/load.py", "asset2sim/report/loops")
}
"""What further checks run besides: it counts where they are asked for."""
IRRELEVANT_SOURCES = ("tasks/check.py",)
"""Sources within them that do not: tables of a study, and what only looks."""
DATA_SUFFIXES = (".csv", ".md")
"""Endings of data files that decide results: the offline model's tables, and prompts."""


def counted_files(root: Path, checks: Sequence[Check] = ()) -> list[str]:
    """The sources and data files of ``ROOMS`` and of these further checks, relative to the checkout ``root``. Raises
    FileNotFoundError for a room that is not there: a hash over nothing would never change."""
    found: list[str] = []
    for room in (*ROOMS, *(room for check in checks for room in ROOMS_OF_CHECKS[check])):
        place = root / room
        files = [place] if place.is_file() else place.rglob("*")
        names = [file.relative_to(root).as_posix() for file in files if file.suffix in (".py", *DATA_SUFFIXES)]
        if not names:
            raise FileNotFoundError(f"{place} holds no sources: content hashes depend on it")
        found += names
    return sorted(set(found) - set(IRRELEVANT_SOURCES))


@functools.cache
def source_version(root: Path = CHECKOUT, checks: tuple[Check, ...] = ()) -> str:
    """SHA-256 over the code of ``counted_files`` without comments and docstrings; computed once a process, in 0.4 s."""
    digest = hashlib.sha256()
    for name in counted_files(root, checks):
        content = (root / name).read_bytes()
        code = bare_code(content) if name.endswith(".py") else content
        digest.update(f"{name}\0{hashlib.sha256(code).hexdigest()}\n".encode())
    return digest.hexdigest()


def bare_code(source: bytes) -> bytes:
    """A source's syntax tree as text: no comments, no layout, and no texts that are statements, as docstrings are."""
    words: list[str] = []
    _spell(ast.parse(source), words)
    return " ".join(words).encode(errors="surrogatepass")


def _spell(part: object, words: list[str]) -> None:
    if isinstance(part, ast.AST):
        if isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant) and isinstance(part.value.value, str):
            return
        words.append(type(part).__name__)
        for field in part._fields:
            _spell(getattr(part, field, None), words)
    elif isinstance(part, list):
        words.append("[")
        for item in part:
            _spell(item, words)
        words.append("]")
    else:
        words.append(repr(part))


def package_versions(settings: EngineSettings) -> dict[str, str]:
    """Package → installed version: ``DECIDING_PACKAGES``, PyBullet, which refines, and the engines that verify."""
    engines = settings.verify if settings.verify is not None else installed()
    found = {}
    for name in (*DECIDING_PACKAGES, *sorted({Engine.PYBULLET.value, *(engine.value for engine in engines)})):
        with suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


IRRELEVANT_SETTINGS: Mapping[str, set[str] | bool] = {
    "run": True,
    # It is the asset's own, as if its row said it.
    "prompt": True,
    # What they let in or keep out is in the list of an asset's files.
    "inputs": {"allow_outside", "packages"},
    # Picture size counts, since a model sees them; whether they are written is read from the folder.
    "views": {"write", "later"},
    "model": {"timeout_s", "max_attempts", "cache", "requests_per_minute", "concurrent_requests"}
    | {"run_calls", "run_tokens", "run_usd"},
}
"""Settings that affect a run, not an asset's result. Assets that fail because of them are tried again anyway."""


def shared_hash(settings: Settings, pipeline: str) -> str:
    """SHA-256 over what all assets of a run depend on: settings, sources, packages and the pipeline's name."""
    chosen = settings.model_dump_json(exclude=IRRELEVANT_SETTINGS)
    left_out = os.environ.get(LEFT_OUT_VARIABLE, "")
    sources = source_version(CHECKOUT, settings.checks) + hashlib.sha256(outside_code()).hexdigest()
    material = [pipeline, chosen, sources, package_versions(settings.engine), left_out]
    return hashlib.sha256(json.dumps(material, sort_keys=True).encode()).hexdigest()


WITHOUT_LINES: Mapping[str, Mapping[str, Mapping[str, bool]]] = {"expectations": {"__all__": {"lines": True}}}


def content_hash(ref: AssetRef, files: str, shared: str, answers: str = "") -> str:
    """SHA-256 over an asset's manifest row and yardsticks, its files' digest, what the run's assets share, and the
    digest of its recorded answers; 64 hex digits."""
    # Where a number or an expectation stands decides nothing.
    row = ref.model_dump(mode="json", exclude={"path": True, "root": True, "overrides": {"where"}, **WITHOUT_LINES})
    material = [row, files, shared, answers]
    return hashlib.sha256(json.dumps(material, sort_keys=True).encode()).hexdigest()
