"""The last line of a measured block: commit, date, command, models, machine, and hashes of the block and of what it
measures, by which a test finds blocks that were edited by hand and names those that the code has left behind."""

import hashlib
import os
import platform
import re
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType

from asset2sim.runs.plan.content_hash import CHECKOUT, source_version
from schemas.model_names import described
from schemas.source_code import code_digest

DIGITS = 12
"""Hexadecimal digits kept of a hash: enough to tell any two states apart."""
NO_HASH = "0" * DIGITS
"""In place of what a block measured before blocks were stamped: it is no state of today's code."""
SUFFIXES = (".py", ".csv", ".sql", ".json", ".yaml")
"""Endings of what is hashed in a study's rooms: code, tables, questions, recorded answers and settings."""
_SETTINGS_COMPARED = ("lab/comparisons", "lab/flows/compare.py", "lab/noise")
_METHODS_COMPARED = ("lab/comparisons", "lab/flows/compare_methods.py", "lab/methods", "lab/noise")
_ROBOT = (
    *("lab/methods", "lab/noise", "lab/schemas", "lab/options.py", "lab/trials"),
    *("lab/flows/in_flow.py", "lab/judged/variant_folders.py", "asset2sim/gym", "asset2sim/load"),
)
SOURCES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "summary": (), "questions": ("lab/pages",),
        "loaders": ("lab/loaders", "asset2sim/load"), "held": ("lab/loaders", "asset2sim/load"),
        "weights": ("lab/weights",),
        "rules": _SETTINGS_COMPARED, "withheld": _SETTINGS_COMPARED, "origins": _SETTINGS_COMPARED,
        "corrections": _SETTINGS_COMPARED, "dataset": _SETTINGS_COMPARED, "compare": _METHODS_COMPARED,
        "first": (*_METHODS_COMPARED, "lab/answers"), "shapes": (*_METHODS_COMPARED, "lab/answers"),
        "judged": (*_ROBOT, "lab/flows/record_motion.py"),
        "learn": (*_ROBOT, "lab/flows/learn.py", "lab/learning", "lab/judged/published.py"),
        "probe": (*_ROBOT, "lab/flows/probe.py", "lab/probes", "lab/judged", "lab/comparisons/statistics.py"),
    }
)  # fmt: skip
"""Measured block → rooms and modules that decide it beside those that decide an asset's result."""
_KNOWN_CODE: dict[str, str] = {}
"""Hash of a source's text → that of its code: studies share most sources, each is parsed once a process."""
NOISY_STUDIES = ("judged", "learn", "probe")
"""Studies of variants that the simulation of a fallible model proposed; others have the default model."""
_MODELS = re.compile(r"\b(?:prior/\w+(?:@[\d.]+)?|recorded/[\w./-]*\w)")
_STAMP = re.compile(
    r"^<sub>Made at (?P<commit>.+?), (?P<date>[\d-]+), by `(?P<command>[^`]+)`; (?P<models>.+?); (?P<machine>.+?); "
    rf"code `(?P<code>\w{{{DIGITS}}})`, block `(?P<block>\w{{{DIGITS}}})`\.</sub>$"
)


@dataclass(frozen=True)
class Stamp:
    """Origin of a measured block; ``code`` is the hash of what it measures, ``block`` that of its own text."""

    commit: str
    date: str
    command: str
    models: str
    machine: str
    code: str
    block: str

    @property
    def line(self) -> str:
        """The stamp as the line that ends a block."""
        return (
            f"<sub>Made at {self.commit}, {self.date}, by `{self.command}`; {self.models}; {self.machine}; "
            f"code `{self.code}`, block `{self.block}`.</sub>"
        )


def new_stamp(name: str, block: str) -> Stamp:
    """The stamp of a block that was measured now, here, with the checkout as it is."""
    return Stamp(
        commit=commit_now(),
        date=f"{datetime.now(UTC):%Y-%m-%d}",
        command=f"make figures ONLY={name}",
        models=models_of(name, block),
        machine=machine_now(),
        code=code_hash(name),
        block=text_hash(block),
    )


def split_stamp(block: str) -> tuple[str, Stamp | None]:
    """A block's text without its stamp, and that; None where it has none."""
    text, _, last = block.strip().rpartition("\n\n")
    found = _STAMP.match(last)
    return (text, Stamp(**found.groupdict())) if found else (block.strip(), None)


def models_of(name: str, block: str) -> str:
    """The models that a block names, else that of its study, in words that say which is a simulation."""
    found = sorted(set(_MODELS.findall(block))) or ["prior/noisy" if name in NOISY_STUDIES else "prior/household"]
    return ("model " if len(found) == 1 else "models ") + ", ".join(map(described, found))


def commit_now() -> str:
    """The checkout's commit, and whether its sources were changed since; ``no commit`` outside of a checkout."""
    try:
        short = _git("rev-parse", "--short=7", "HEAD")
        changed = _git("status", "--porcelain", "--", ":!docs", ":!README.md")
    except (OSError, subprocess.CalledProcessError):
        return "no commit"
    return f"`{short}`{' with changes' if changed else ''}"


def machine_now() -> str:
    """Cores, memory and kind of this machine, without its name."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return f"{os.cpu_count()} cores, {memory:.0f} GB, {platform.system()} {platform.machine()}"


def code_hash(name: str, root: Path = CHECKOUT) -> str:
    """Hash of what a block measures: the code, prompts and tables that decide an asset's result, and the rooms of its
    own study, without comments and docstrings."""
    files: dict[str, Path] = {}
    for room in SOURCES[name]:
        place = root / room
        found = [place] if place.is_file() else place.rglob("*")
        files |= {file.relative_to(root).as_posix(): file for file in found if file.suffix in SUFFIXES}
    return hashlib.sha256((source_version(root) + code_digest(files, known=_KNOWN_CODE)).encode()).hexdigest()[:DIGITS]


def text_hash(block: str) -> str:
    """Hash of a block's text, whatever blank lines are around it."""
    return hashlib.sha256(block.strip().encode()).hexdigest()[:DIGITS]


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=CHECKOUT, check=True, capture_output=True, text=True).stdout.strip()
