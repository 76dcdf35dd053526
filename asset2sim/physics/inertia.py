"""Inertia tensors: closed forms, and the repair of those that no rigid body could have; how much material a wall is."""

from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array
from schemas.base import Inertia6


@dataclass(frozen=True)
class PhysicalTensor:
    """A physical tensor, (3, 3) kg·m², and the changes that made it so (empty if none)."""

    tensor: Array
    changes: tuple[str, ...]


def box_inertia(mass: float, size: Array) -> Array:
    """(3, 3) inertia of a solid box of edge lengths ``size`` (m) about its centre: m (b² + c²) / 12 on the diagonal."""
    squared = np.asarray(size, dtype=float) ** 2
    diagonal: Array = np.diag(mass * (squared.sum() - squared) / 12.0)
    return diagonal


def tensor_of(six: Inertia6) -> Array:
    """(3, 3) symmetric tensor of (ixx, ixy, ixz, iyy, iyz, izz)."""
    ixx, ixy, ixz, iyy, iyz, izz = six
    return np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])


def make_physical(tensor: Array, smallest: float) -> PhysicalTensor:
    """The nearest tensor that a rigid body could have (paper, "Synthesize").

    Off-diagonals that break a Cauchy-Schwarz bound |I_ij| ≤ √(I_ii I_jj) are dropped; principal moments are raised to
    ``smallest`` (kg·m²) and until the largest is at most the sum of the others.
    """
    mended = (tensor + tensor.T) / 2.0
    changes: list[str] = []
    for i, j in ((0, 1), (0, 2), (1, 2)):
        if mended[i, j] ** 2 > max(mended[i, i], 0.0) * max(mended[j, j], 0.0):
            mended[i, j] = mended[j, i] = 0.0
            changes.append(f"I{'xyz'[i]}{'xyz'[j]} dropped: it broke the Cauchy-Schwarz bound")
    moments, axes = np.linalg.eigh(mended)
    if moments[0] < smallest:
        moments = np.maximum(moments, smallest)
        changes.append(f"principal moments raised to {smallest:.3g} kg·m²")
    # Equality holds for a flat plate; a hair more keeps engines that test strictly from refusing it.
    short = moments[2] * (1.0 + 1e-6) - (moments[0] + moments[1])
    if short > 0.0:
        moments[:2] += short / 2.0
        changes.append("smaller principal moments raised to meet the triangle inequality")
    if not changes:
        return PhysicalTensor(mended, ())
    return PhysicalTensor(axes @ np.diag(moments) @ axes.T, tuple(changes))


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


def solid_to_shell(solid: Array, shell: Array, filled: float) -> Array:
    """Mean of a solid's and a shell's tensor or centre, per unit of mass; ``filled`` is the material's share."""
    share = min(max(filled, 0.0), 1.0)
    return share * solid + (1.0 - share) * shell
