"""The drop: the object falls on the plane in its initial state."""

from collections.abc import Mapping

from asset2sim.checks.watch import capped, watch
from asset2sim.engines.world import World
from schemas.interaction import Drop
from schemas.settings import EngineSettings


def drop(world: World, positions: Mapping[str, float], settings: EngineSettings) -> Drop:
    """Drop the object from ``fall_height_m`` and watch it until it is still, at most ``fall_s``; free root, a plane."""
    world.place(positions, height_m=settings.fall_height_m)
    seen = watch(world, settings.fall_s, settings)
    return Drop(
        timestep_s=world.timestep_s,
        height_m=settings.fall_height_m,
        seconds=seen.seconds,
        peak_speed_m_s=seen.peak,
        final_speed_m_s=seen.final,
        sink_m=max(0.0, -capped(world.lowest_m())) if seen.finite else 0.0,
        finite=seen.finite,
    )
