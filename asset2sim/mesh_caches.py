"""What is kept of meshes under the output folder, by what their files hold: losing it costs time only."""

SHAPES = ".cache/shapes"
"""The shapes and the triangles of meshes that have been read before."""
PIECES = ".cache/pieces"
"""Convex pieces, shared by all assets and runs."""
