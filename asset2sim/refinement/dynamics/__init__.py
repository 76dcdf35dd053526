"""The loop over dynamics: each failing test maps to the parameters that can mend it, and a simulator decides."""
