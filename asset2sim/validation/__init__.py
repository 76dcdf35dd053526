"""Validate: a model's ``Overlay`` → a complete ``PhysicsOverlay``, with a finding for every change. Mechanical,
not semantic."""
