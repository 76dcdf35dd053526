"""Content hash of an asset: everything that its result depends on, the code and the packages' versions included."""

import functools
import hashlib
import json
import os
import sys
from collections.abc import Mapping
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

import schemas.source_code
from asset2sim.engines.registry import installed, versions_of
from asset2sim.guidance.csv_rows import LEFT_OUT_VARIABLE
from asset2sim.storage.objects import cache_root
from asset2sim.storage.regular_files import write_whole
from schemas.asset import AssetRef
from schemas.declared import CHECK, ENGINE, METHOD, extensions, outside_code
from schemas.extensions import further_check, local_models
from schemas.model_names import named_models
from schemas.settings import EngineSettings, Settings
from schemas.source_code import code_digest
from schemas.vocabulary import DECIDING_PACKAGES, Engine, Method

CHECKOUT = Path(__file__).resolve().parents[3]
ROOMS = (
    *("schemas", "tasks", "asset2sim/guidance", "asset2sim/render"),
    *("asset2sim/intake", "asset2sim/storage/regular_files.py"),
    *("asset2sim/physics", "asset2sim/assets", "asset2sim/models", "asset2sim/validation", "asset2sim/engines"),
    *("asset2sim/checks", "asset2sim/refinement", "asset2sim/baselines"),
    # Of what loads an object for users, what the SAPIEN engine loads with.
    *(f"asset2sim/load/{module}.py" for module in ("description", "in_sapien", "loaded", "shapes")),
    # An asset's rows, and the records of those that fail outside the pipeline.
    *("asset2sim/catalog/rows.py", "asset2sim/catalog/rows_engines.py", "asset2sim/catalog/summarize.py"),
    *("asset2sim/experiments/isolation", "asset2sim/runs/asset_attempt.py"),
    *("asset2sim/runs/remote/transfer.py", "asset2sim/runs/spread/worker.py"),
)
"""Folders and modules, relative to the checkout, that decide an asset's result or its rows."""
IRRELEVANT_SOURCES = ("tasks/check.py",)
"""Sources within them that do not: tables of a study, and what only looks."""
SPELLING = Path(schemas.source_code.__file__)
MOST_KNOWN = 4000
"""Sources whose hash is kept for later processes: ten states of all of them, 0.5 MB."""
SHA256_DIGITS = 64
DATA_SUFFIXES = (".csv", ".md")
"""Endings of data files that decide results: the offline model's tables, and prompts."""


def counted_files(root: Path) -> list[str]:
    """The sources and data files of ``ROOMS``, relative to the checkout ``root``. Raises FileNotFoundError for a room
    that is not there: a hash over nothing would never change."""
    found = [file.relative_to(root).as_posix() for room in ROOMS for file in _sources(root / room)]
    return sorted(set(found) - set(IRRELEVANT_SOURCES))


def _sources(place: Path) -> list[Path]:
    files = [place] if place.is_file() else place.rglob("*")
    found = [file for file in files if file.suffix in (".py", *DATA_SUFFIXES)]
    if not found:
        raise FileNotFoundError(f"{place} holds no sources: content hashes depend on it")
    return found


def module_files(name: str) -> dict[str, Path]:
    """The sources of a module, or all those of a package, wherever it is installed, by their names from its root."""
    spec = find_spec(name)
    if spec is None or spec.origin is None:
        raise FileNotFoundError(f"{name} is not installed: content hashes depend on it")
    package = spec.submodule_search_locations is not None
    place = Path(spec.origin).parent if package else Path(spec.origin)
    root = place.parents[name.count(".")]
    return {file.relative_to(root).as_posix(): file for file in _sources(place)}


def extension_sources(settings: Settings) -> tuple[str, ...]:
    """Modules and packages of extensions that decide a result with these settings."""
    models = {model.partition("@")[0] for model in named_models(settings.model)} & local_models().keys()
    kinds = {CHECK, ENGINE} if settings.method is Method.ASSET2SIM else {CHECK, ENGINE, METHOD}
    counted = [item.declares.get(kind, ()) for item in extensions() for kind in sorted(kinds)]
    counted += [further_check(name).sources for name in settings.checks]
    counted += [local_models()[name].sources for name in sorted(models)]
    return tuple(source for sources in counted for source in sources)


@functools.cache
def source_version(root: Path = CHECKOUT, modules: tuple[str, ...] = ()) -> str:
    """SHA-256 over the code of ``counted_files`` and of further modules, without comments and docstrings; computed once
    a process. Parsing all takes 1 to 2 s of processor time, so that this user's next process finds each source's."""
    files = {name: root / name for name in counted_files(root)}
    for module in modules:
        files |= module_files(module)
    # What a source parses to depends on Python, and what of it counts on the module that says so.
    store = cache_root() / f"code-{sys.hexversion:x}-{hashlib.sha256(SPELLING.read_bytes()).hexdigest()[:16]}.json"
    known = _known_code(store)
    before = len(known)
    found = code_digest(files, known=known)
    if len(known) > before:
        with suppress(OSError):
            write_whole(store, json.dumps(dict([*known.items()][-MOST_KNOWN:])).encode())
    return found


def _known_code(store: Path) -> dict[str, str]:
    """Hash of a source's text → hash of its code, of earlier processes; nothing where the file is damaged."""
    try:
        known = json.loads(store.read_bytes())
        return known if all(len(value) == len(key) == SHA256_DIGITS for key, value in known.items()) else {}
    except (OSError, ValueError, AttributeError, TypeError):
        return {}


def package_versions(settings: EngineSettings) -> dict[str, str]:
    """Package → installed version: ``DECIDING_PACKAGES``, PyBullet, which refines, and the engines that verify."""
    engines = settings.verify if settings.verify is not None else installed()
    return versions_of((*DECIDING_PACKAGES, *sorted({Engine.PYBULLET.value, *(engine.value for engine in engines)})))


IRRELEVANT_SETTINGS: Mapping[str, set[str] | bool] = {
    "run": True,
    # It is the asset's own, as if its row said it.
    "prompt": True,
    # What they let in or keep out is in the list of an asset's files.
    "inputs": {"allow_outside", "packages"},
    # Picture size counts, since a model sees them; whether they are written is read from the folder.
    "views": {"write"},
    "model": {"timeout_s", "max_attempts", "cache", "requests_per_minute", "concurrent_requests"}
    | {"run_calls", "run_tokens", "run_usd"},
}
"""Settings that affect a run, not an asset's result. Assets that fail because of them are tried again anyway."""


def shared_hash(settings: Settings, pipeline: str) -> str:
    """SHA-256 over what all assets of a run depend on: settings, sources, packages and the pipeline's name."""
    chosen = settings.model_dump_json(exclude=IRRELEVANT_SETTINGS)
    left_out = os.environ.get(LEFT_OUT_VARIABLE, "")
    sources = source_version(CHECKOUT, extension_sources(settings)) + hashlib.sha256(outside_code()).hexdigest()
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
