"""Refine: the closed loop over joint positions (paper, "Refine the state"). Propose, evaluate Φ, accept only
what falls."""
