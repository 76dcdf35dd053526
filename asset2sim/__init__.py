"""How it is done: URDF, geometry, physics, engines, search, models and the catalog, as plain functions over
frozen data."""
