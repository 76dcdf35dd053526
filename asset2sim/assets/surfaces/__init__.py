"""Painted surfaces: meshes and primitives with their materials, as pictures and exports need them."""
