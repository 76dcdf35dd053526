"""Refine the state: propose joint positions, evaluate Φ, accept only what lowers it (paper, "Refine the state")."""
