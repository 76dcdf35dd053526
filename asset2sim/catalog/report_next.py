"""The end of a report: what to do next. Pure."""

import shlex
from collections.abc import Sequence

from asset2sim.catalog.changes import Changes
from asset2sim.catalog.run import RunRow
from schemas.asset import AssetRecord, Unchanged
from schemas.vocabulary import RETRIED_MODES, Status


def next_steps(
    run: RunRow, records: Sequence[AssetRecord], changes: Changes, unchanged: Sequence[Unchanged], out: str
) -> list[str]:
    """Sentences in Markdown, the most urgent first; none where nothing failed and nothing is left to do."""
    place = shlex.quote(out)
    steps = []
    if run.outcome == "interrupted":
        steps.append("The run was stopped before its end; the next one goes on from there.")
    if changes.new_failures:
        steps.append(
            f"What is known of a failure: `asset2sim show ASSET --out {place}`; what broke since the last run: "
            f"`asset2sim failures --compare previous latest --out {place}`."
        )
    every: list[AssetRecord | Unchanged] = [*records, *unchanged]
    failed = [item for item in every if item.status is Status.FAILED]
    passing = sum(item.failure_mode in RETRIED_MODES for item in failed)
    if passing:
        modes = ", ".join(f"`{mode.value}`" for mode in RETRIED_MODES)
        steps.append(f"{_assets(passing)} what may pass ({modes}): the next run tries again by itself.")
    if len(failed) > passing:
        steps.append(
            f"{_assets(len(failed) - passing)} what is in the dataset: change files or prompt, and the next run "
            "takes it up by itself; until then it is left alone (`--retry-failed` asks again all the same)."
        )
    return steps


def _assets(count: int) -> str:
    return "1 asset fails by" if count == 1 else f"{count} assets fail by"
