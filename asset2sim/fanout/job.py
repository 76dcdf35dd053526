"""What travels to a Dask worker: one asset, the name under which its record is kept, and how a first attempt ended."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

from schemas.asset import AssetRef
from schemas.request import ModelCall


@dataclass(frozen=True)
class FirstAttempt:
    """How an asset's first attempt died, in words, and the model calls that it had made until then."""

    died: str
    calls: tuple[ModelCall, ...] = ()


@dataclass(frozen=True)
class Job:
    """One asset to refine; ``first`` is None unless it is tried once more."""

    ref: AssetRef
    content_hash: str
    first: FirstAttempt | None = None

    @property
    def attempt(self) -> int:
        """1, or 2 where a first attempt died."""
        return 1 if self.first is None else 2


def job_of(ref: AssetRef, run_id: str, hashes: Mapping[str, str] | None) -> Job:
    """The asset's job under its content hash, or, in a run without a plan, under a name that no other run has."""
    if hashes is not None:
        return Job(ref, hashes[ref.asset_id])
    return Job(ref, hashlib.sha256(f"{run_id}\0{ref.asset_id}".encode(errors="surrogateescape")).hexdigest())
