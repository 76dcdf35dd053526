"""A hostile case: what it writes, and what must become of it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from schemas.errors import MISTAKE
from schemas.vocabulary import FailureMode

CANARY = "CANARY-5f1c77ab"
"""Text of files outside the dataset, which must not come into the output."""
KEY = "sk-hostile-9d41c0ffee"
"""A key in the command's environment, which must not either."""

_OURS = {FailureMode.ENGINE_CRASH, FailureMode.TIMEOUT, FailureMode.DISK_FULL, FailureMode.MODEL_ERROR}
HANDLED = frozenset(set(FailureMode) - _OURS)
"""Modes that say something of the asset: a broken program, or one that hangs, ends in none of them."""
_REFUSED = {FailureMode.UNREADABLE_ASSET, FailureMode.MISSING_MESH, FailureMode.INVALID_JOINT_CONFIGURATION}
REFUSED = frozenset(_REFUSED)
"""Modes of an asset that was not simulated."""
READ = HANDLED - REFUSED
"""Modes of an asset that was read and simulated, whatever physics said."""
UNREADABLE = frozenset({FailureMode.UNREADABLE_ASSET})


@dataclass(frozen=True)
class Place:
    """Where a case writes: the dataset's folder, the asset's in it, which is not there yet, and one outside. A case of
    its own may also write its output before the command does."""

    data: Path
    asset: Path
    outside: Path

    @property
    def out(self) -> Path:
        """The command's output."""
        return self.data.parent / "out"


@dataclass(frozen=True)
class Case:
    """A hostile dataset, or one asset of a dataset that it shares with others.

    ``modes``: it has a row with one of these failure modes; empty: it has a dataset of its own, and the command says
    one line and exits with 2. ``says`` must stand in the row's reason or in the line. ``asset_id`` is its row's where
    it is not ``name``; ``row`` its line in a manifest of ``COLUMNS``, else its dataset has none. Cases with the same
    ``words`` share a command. ``command``: what is run for a case of its own, unless ``line`` has all words, in which
    DATA and OUT stand for its folders; it ends with ``code``. ``finds``: the code of a finding that its row must have.
    """

    name: str
    write: Callable[[Place], None]
    modes: frozenset[FailureMode] = frozenset()
    says: str = ""
    asset_id: str = ""
    row: str = ""
    words: tuple[str, ...] = ()
    command: str = "refine"
    finds: str = ""
    line: tuple[str, ...] = ()
    code: int = MISTAKE

    @property
    def row_id(self) -> str:
        """Its row's id."""
        return self.asset_id or self.name


COLUMNS = ("asset_id", "path", "category", "prompt")
"""The columns of the manifest that cases with a row share."""

RULES = ("--method", "asset2sim", "--collision", "repair")
"""Options for cases in which files are brought into the output."""
