"""A hand that uses objects in MuJoCo: a gripper that floats, with a hand's force, and the checks of what it does."""
