"""Mass, inertia, and joint dynamics from what a joint moves."""
