"""Objects that each engine's own loader makes of a refined URDF: measured by behaviour, for a table of the
documentation."""
