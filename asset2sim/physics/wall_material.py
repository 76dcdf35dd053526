"""How much material a wall of even thickness is, and the inertia of bodies between shell and solid."""

from asset2sim.physics.arrays import Array

SHEET_M = 2e-3
"""Most that a link drawn without any thickness is thick, m: as its collision shape (``sheet_thickness_m``)."""


def wall_volume(outer_m2: float, wall_m: float, hull_volume_m3: float) -> float:
    """Volume of a wall, m³, over an area that counts both sides of a sheet. It is never more than the hull's: what is
    drawn thinner than two walls is solid. A link without a hull is a sheet of at most ``SHEET_M``."""
    most = hull_volume_m3 if hull_volume_m3 > 0.0 else outer_m2 / 2.0 * SHEET_M
    return min(outer_m2 * wall_m, most)


def between(solid: Array, shell: Array, filled: float) -> Array:
    """Mean of a solid's and a shell's tensor or centre, per unit of mass: ``filled`` is the share of the volume that is
    material, 1 for solid."""
    share = min(max(filled, 0.0), 1.0)
    return share * solid + (1.0 - share) * shell
