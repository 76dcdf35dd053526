"""Meshes: loading, volumes, hulls, convex pieces, and which end of a joint is closed."""
