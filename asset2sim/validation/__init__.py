"""Validate: a model's ``Overlay`` → a complete ``PhysicsOverlay``, with a finding for every change. Mechanical,
not semantic."""

from asset2sim.validation.overlay import validate

__all__ = ["validate"]
