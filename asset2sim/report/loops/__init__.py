"""Motion loops and the size picture of an object's page: raw beside refined, made only for what changed."""

from asset2sim.report.loops.write import is_current, loops_key, write_loops

__all__ = ["is_current", "loops_key", "write_loops"]
