"""The closed loop: what the simulator's verdict changes in state, collision shapes and dynamics."""
