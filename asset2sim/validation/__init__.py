"""Validate: a model's ``Overlay`` → a complete ``PhysicsOverlay``, with a finding for every change. Mechanical,
not semantic."""

from asset2sim.validation.validate import validate

__all__ = ["validate"]
