"""Validate (mechanically): a model's ``Overlay`` → a complete ``PhysicsOverlay``, a finding for every change."""
