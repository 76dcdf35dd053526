"""Which joints may be tested in one run, and how a test is run over all joints at once.

With the root held, the mass matrix couples two joints only where one is an ancestor of the other: a link moves with
both. Joints of which none is an ancestor of another are therefore independent, and one run tests them all; what is left
to couple them is contact between the parts that they move. So joints that do badly in company are
tested again in smaller company, at last alone.
"""

import itertools
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

from asset2sim.interaction.mechanism import Mechanism

MOST_RUNS = 16
"""Runs of one test after which no batch is halved any more: one bad key among a hundred takes 14 to be found."""

Record = TypeVar("Record")


def depth_groups(item: Mechanism, names: Iterable[str]) -> list[tuple[str, ...]]:
    """The joints in groups of which none holds a joint and an ancestor of it: by their depth among the named ones."""
    wanted = set(names)
    groups: dict[int, list[str]] = {}
    for joint in item.joints:
        if joint.name in wanted:
            child = next(entry.child for entry in item.tree if entry.name == joint.name)
            depth = sum(1 for above in item.chain[child] if above in wanted)
            groups.setdefault(depth, []).append(joint.name)
    return [tuple(groups[depth]) for depth in sorted(groups)]


def in_batches(
    item: Mechanism,
    names: Iterable[str],
    run: Callable[[Sequence[str]], dict[str, Record]],
    good: Callable[[Record], bool],
) -> dict[str, Record]:
    """Run a test on independent joints together; those whose record is not ``good`` again in halves, at last alone."""
    records: dict[str, Record] = {}
    waiting = depth_groups(item, names)
    for number in itertools.count():
        if not waiting:
            break
        group = waiting.pop(0)
        together = run(group)
        records |= together
        doubtful = tuple(name for name in group if name in together and not good(together[name]))
        if doubtful and len(group) > 1 and number < MOST_RUNS:
            half = len(doubtful) // 2
            waiting += [part for part in (doubtful[:half], doubtful[half:]) if part]
    return records
