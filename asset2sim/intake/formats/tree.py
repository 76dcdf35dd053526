"""The tree among bodies that joints tie, whichever way each joint is stated."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class SpanningTree:
    """The ``roots``, one of each group of bodies that hang together; ``ways``, the numbers of the joints from them on,
    parents first, each with whether it is turned round: its second end is the parent; and ``loops``, the numbers of
    the joints that would close a loop."""

    roots: tuple[str, ...]
    ways: tuple[tuple[int, bool], ...]
    loops: tuple[int, ...]


def spanning(bodies: Sequence[str], ends: Sequence[tuple[str, str]]) -> SpanningTree:
    """The tree of ``bodies``, of which those to be roots come first; ``ends`` are the joints', of which those that are
    to be left out where they close a loop come last."""
    group = {body: body for body in bodies}

    def top(body: str) -> str:
        while group[body] != body:
            group[body] = body = group[group[body]]
        return body

    at: dict[str, list[tuple[int, str, bool]]] = {body: [] for body in bodies}
    loops = list[int]()
    for number, (first, second) in enumerate(ends):
        one, other = top(first), top(second)
        if one == other:
            loops.append(number)
            continue
        group[other] = one
        at[first].append((number, second, False))
        at[second].append((number, first, True))
    roots, ways, reached = list[str](), list[tuple[int, bool]](), set[str]()
    for body in bodies:
        if body in reached:
            continue
        roots.append(body)
        reached.add(body)
        waiting = [body]
        for above in waiting:
            for number, below, turned in at[above]:
                if below not in reached:
                    reached.add(below)
                    waiting.append(below)
                    ways.append((number, turned))
    return SpanningTree(tuple(roots), tuple(ways), tuple(loops))
