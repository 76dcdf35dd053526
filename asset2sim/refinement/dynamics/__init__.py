"""Refine the dynamics: each failing check maps to parameters that can mend it, and a simulator decides."""
