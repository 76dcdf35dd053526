"""The probe trials that outputs keep. Needs no engine: what reads them may not have any."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from asset2sim.catalog.own_files import read_own_files
from lab.schemas.tables_probes import PROBE_TRIALS

KEY = list(PROBE_TRIALS.key)
"""Columns that make a trial."""


def latest_probes(outs: Sequence[Path | str]) -> pd.DataFrame:
    """The latest row of every trial in these outputs."""
    frames = [read_own_files(out, PROBE_TRIALS) for out in outs]
    whole = pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=PROBE_TRIALS.schema.names)
    return whole.sort_values("recorded_at").drop_duplicates(KEY, keep="last").sort_values(KEY, ignore_index=True)


def results(out: Path) -> set[tuple[object, ...]]:
    """Key, seed and run of each trial of an output whose latest row has a result."""
    kept = latest_probes([out]).dropna(subset=["success"])
    return set(kept[[*KEY, "seed", "run_id"]].itertuples(index=False, name=None))
