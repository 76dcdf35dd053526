"""The implementation: URDF, geometry, physics, engines, search, models and catalog, as functions over frozen data."""
