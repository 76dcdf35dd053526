"""Findings of the loop: what it changed, and why."""

from collections.abc import Mapping, Sequence

from asset2sim.collision.trim import Cut
from asset2sim.search.loop import Log
from asset2sim.search.proposals import Pose
from asset2sim.search.shapes import Attempt
from schemas.finding import Finding
from schemas.vocabulary import Severity, Stage


def moves(requested: Pose, moved: Mapping[str, float], why: str) -> list[Finding]:
    """A finding for every joint that starts elsewhere than was asked or assumed."""
    return [
        Finding(
            stage=Stage.REFINE,
            severity=Severity.INFO,
            code="state_moved",
            message=f"joint '{name}' starts at {value:.4g} in place of {requested[name]:.4g}: {why}",
            joint=name,
            value=value,
            limit=requested[name],
        )
        for name, value in moved.items()
    ]


def note_shapes(best: Attempt, log: Log) -> None:
    """A finding for every link that lost part of its collision shape, with the links it was
    cleared of."""
    note_cuts(best.cut, "where it overlaps", "in every state near the requested one", log)


def note_cuts(cuts: Sequence[Cut], where: str, when: str, log: Log) -> None:
    """A finding for every link that lost part of its collision shape."""
    for link in sorted({cut.link for cut in cuts}):
        own = [cut for cut in cuts if cut.link == link]
        deepest = max(own, key=lambda cut: cut.depth_m)
        others = ", ".join(f"'{cut.other}'" for cut in own[:4]) + (f" and {len(own) - 4} more" if len(own) > 4 else "")
        log.findings.append(
            Finding(
                stage=Stage.REFINE,
                severity=Severity.WARNING,
                code="collision_cut",
                message=f"collision of link '{link}' cut by up to {1e3 * deepest.depth_m:.3g} mm "
                f"({deepest.share:.0%} of a hull) {where} {others} {when}; its looks are unchanged",
                link=link,
                value=deepest.depth_m,
            )
        )
