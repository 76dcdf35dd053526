"""How far ahead of a contact an engine looks."""

FORESEEN_M_S = 1.2
"""Speed, m/s, up to which contact is foreseen a step ahead: a fall of 5 cm ends at 1 m/s, and must not end inside.
Looking further makes a step of an object of many parts several times slower, for neighbours that never touch."""


def foreseen_m(timestep_s: float) -> float:
    """Distance, m, from which contact with the plane is foreseen."""
    return FORESEEN_M_S * timestep_s
