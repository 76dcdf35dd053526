"""Which tasks are asked for."""

from collections.abc import Sequence

from asset2sim.probes.probe_study import NamedTask
from asset2sim.trials.tasks import PAPER
from schemas.errors import UnknownChoiceError

PAPER11 = "paper11"
"""The name of all of the paper's tasks."""


def chosen_tasks(names: Sequence[str]) -> dict[str, tuple[NamedTask, ...]]:
    """Asset → its tasks among those named. Raises UnknownChoiceError for a name that is none."""
    known = {task.name for tasks in PAPER.values() for task in tasks}
    for name in names:
        if name not in known | {PAPER11}:
            raise UnknownChoiceError("task", name, (PAPER11, *known))
    chosen = known if PAPER11 in names else set(names)
    return {
        asset_id: found
        for asset_id, tasks in PAPER.items()
        if (found := tuple(task for task in tasks if task.name in chosen))
    }
