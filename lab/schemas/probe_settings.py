"""Limits of what a policy behind a socket may take: how long it is waited for, and how much it may say."""

from schemas.base import Frozen, Positive


class ProbeSettings(Frozen):
    """How long and how often a policy's server is asked before a trial ends without it."""

    connect_s: Positive = 20.0
    """Time for a first connection, s: a server that is just starting is tried again and again meanwhile."""
    reconnect_s: Positive = 5.0
    """Time for another connection where one broke in the middle of an episode, s: the question is then put again."""
    first_answer_s: Positive = 180.0
    """Time for the first answer over a connection, s: JAX compiles a policy when it is first asked."""
    answer_s: Positive = 30.0
    """Time for every other answer, s: real policies take 0.1 to 0.5."""
    most_bytes: int = 16 * 1024 * 1024
    """Largest frame that is read. An answer of 15 actions has a kilobyte."""
    most_actions: int = 1000
    """Longest chunk that is accepted; the policies in use answer 10 to 32."""
    trial_s: Positive = 900.0
    """Wall time of one trial, s."""
    trial_mb: int = 6144
    """Memory that one trial's process may add, MB."""
    unreachable_in_a_row: int = 3
    """So many trials in a row that found no server end the run: the rest waits for the next one."""
