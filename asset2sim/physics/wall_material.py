"""How much material a wall of even thickness is, and the inertia of bodies between shell and solid."""

from asset2sim.physics.arrays import Array

PLATE_SHARE = 0.125
"""Thickness over width of the thickest plates, those of refrigerators' doors: 60 to 70 mm of 550 to 600 (makers'
dimension drawings). Boards, panes and safes' doors have a tenth to a third of that."""


def wall_volume(outer_m2: float, wall_m: float, hull_volume_m3: float, diagonal_m: float) -> float:
    """Volume of a wall, m³, over an area that counts both sides of a sheet. It is never more than the hull's, since
    what is drawn thinner than two walls is solid, or than a plate's of that area: many are drawn as sheets.

    ``diagonal_m`` is that of the link's box.
    """
    return min(outer_m2 * wall_m, max(hull_volume_m3, plate_volume(outer_m2, diagonal_m)))


def plate_volume(outer_m2: float, diagonal_m: float) -> float:
    """Most volume of a plate, m³, whose two faces have this area together, however thin it is drawn."""
    face_m2 = outer_m2 / 2.0
    # A face over its diagonal is 0.7 to 1 times its shorter side, however the plate stands in its frame.
    return face_m2 * PLATE_SHARE * face_m2 / diagonal_m if diagonal_m > 0.0 else 0.0


def between(solid: Array, shell: Array, filled: float) -> Array:
    """Mean of a solid's and a shell's tensor or centre, per unit of mass: ``filled`` is the share of the volume that is
    material, 1 for solid."""
    share = min(max(filled, 0.0), 1.0)
    return share * solid + (1.0 - share) * shell
