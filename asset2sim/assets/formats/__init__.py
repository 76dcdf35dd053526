"""Descriptions that an asset's folder may hold instead of a URDF (xacro, SDF, MJCF), and the URDF that is made of
it."""
