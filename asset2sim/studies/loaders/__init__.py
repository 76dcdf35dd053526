"""What each engine's own loader makes of a refined URDF: measured by behaviour, for the README's table."""
