"""Convex hulls of points that may have none."""

from scipy.spatial import ConvexHull, QhullError

from asset2sim.physics.arrays import Array


def convex_hull(points: Array) -> ConvexHull | None:
    """The hull of (n, k) points; None where they are too few, or in one plane, on one line of two dimensions."""
    try:
        return ConvexHull(points)
    except (QhullError, ValueError):
        return None


def hull_volume(points: Array) -> float:
    """Volume of the hull of (n, 3) points, m³, or area of that of (n, 2) points, m²; 0 where there is none."""
    hull = convex_hull(points)
    return 0.0 if hull is None else float(hull.volume)
