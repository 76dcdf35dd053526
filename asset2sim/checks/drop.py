"""The drop: from a small height on a plane, at both time steps; it must not explode, and must come to rest."""

from collections.abc import Mapping

from asset2sim.checks.declared_check import DeclaredCheck
from asset2sim.checks.rig import Rig
from asset2sim.checks.watch import Harmless, capped_reading, harmless, watch
from asset2sim.engines.world import World
from schemas.interaction import Drop, Interaction
from schemas.overlay import JointPhysics
from schemas.settings import EngineSettings, Thresholds
from schemas.verdict import CheckVerdict, Guide
from schemas.vocabulary import FailureMode


def measure(rig: Rig) -> dict[str, object]:
    """Its drops at both time steps; of a fixed object, rest at both."""
    rig.down()
    world = rig.resting_world.sound()
    calm = harmless(world, rig.item, rig.settings, rig.limits)
    fine = drop(world, rig.item.start, rig.settings, held=rig.fixed, calm=calm)
    with rig.coarse_world() as coarse:
        rough = drop(coarse.ready(), rig.item.start, rig.settings, held=rig.fixed, calm=calm)
        return {"drops": (fine, rough)}


def drop(
    world: World,
    positions: Mapping[str, float],
    settings: EngineSettings,
    *,
    held: bool = False,
    calm: Harmless | None = None,
) -> Drop:
    """Drop the object from ``fall_height_m`` on a plane and watch it until it is still, or ``calm``, at most
    ``fall_s``; from no height, and over no plane, where its root is ``held``."""
    height = 0.0 if held else settings.fall_height_m
    world.place(positions, height_m=height)
    seen = watch(world, settings.fall_s, settings, calm=calm)
    return Drop(
        timestep_s=world.timestep_s,
        height_m=height,
        seconds=seen.seconds,
        peak_speed_m_s=seen.peak,
        final_speed_m_s=seen.final,
        sink_m=max(0.0, -capped_reading(world.lowest_m())) if seen.finite and not held else 0.0,
        finite=seen.finite,
    )


def judge(seen: Interaction, joints: Mapping[str, JointPhysics], limits: Thresholds) -> list[CheckVerdict]:
    """One verdict a drop."""
    return [drop_verdict(item, seen.engine.value, limits) for item in seen.drops]


def drop_verdict(item: Drop, engine: str, limits: Thresholds) -> CheckVerdict:
    """A dropped object must not explode, must come to rest and must not end in the plane."""
    subject = f"{1.0 / item.timestep_s:.0f} Hz"
    dropped = f"dropped from {100 * item.height_m:.3g} cm in {engine} at {subject}"
    peak = (item.peak_speed_m_s, limits.peak_speed_m_s)
    final = (item.final_speed_m_s, limits.final_speed_m_s)
    if not item.finite or peak[0] > peak[1]:
        reason = f"{dropped} it explodes: a link reaches {peak[0]:.3g} m/s"
        return CheckVerdict(FailureMode.DROP, subject, False, *peak, reason)
    if final[0] > final[1]:
        reason = f"{dropped} a link still moves at {final[0]:.3g} m/s after {item.seconds:.3g} s"
        return CheckVerdict(FailureMode.DROP, subject, False, *final, reason)
    if item.sink_m > limits.sink_m:
        reason = f"{dropped} it ends {1e3 * item.sink_m:.3g} mm deep in the plane"
        return CheckVerdict(FailureMode.DROP, subject, False, item.sink_m, limits.sink_m, reason)
    reason = f"{dropped} it reaches {peak[0]:.3g} m/s and is at rest after {item.seconds:.3g} s"
    return CheckVerdict(FailureMode.DROP, subject, True, *peak, reason)


CHECK = DeclaredCheck(
    name="drop",
    modes={
        FailureMode.DROP: Guide(
            "Dropped from 5 cm it flies apart, or is not at rest within 6 s",
            "look for very light links and thin hulls in `links`; `--collision decompose` makes the pieces anew",
        )
    },
    done="from 5 cm, at 240 Hz and at 60 Hz",
    holds="no link above 6 m/s, at rest on the plane within 6 s",
    bounds=("peak_speed_m_s", "final_speed_m_s", "sink_m"),
    measure=measure,
    judge=judge,
    place=30,
    turn=30,
    on_plane=True,
    along=(FailureMode.STANDS, FailureMode.STATE),
    planted=("inertia of a point", "damping over the bound"),
)
