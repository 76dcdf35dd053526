"""Measurements of one refined asset in one engine. Numbers only: the verdict is a pure function of them."""

from schemas.base import Frozen, NonNegative


class ContactPair(Frozen):
    """Two links that overlap, with the deepest point and the sum over their contact points, m."""

    link_a: str
    link_b: str
    depth_m: NonNegative
    penetration_m: NonNegative
    n_points: int


class JointMotion(Frozen):
    """One joint's motion without actuation: A = max q − min q and the sign changes of Δq (paper, section 1)."""

    name: str
    amplitude: NonNegative
    sign_changes: int
    final_position: float


class Measurement(Frozen):
    """One engine's record of one asset.

    ``penetration_m`` is Φ(q) at the initial position under the engine's default contact filter. Drift and joint motion
    are taken over the test that follows settling, on a plane with a free base and no actuation. ``peak_speed_m_s``
    is the fastest link over settling and test; ``settle_motion`` each joint's furthest from its initial position.
    """

    engine: str
    engine_version: str
    timestep_s: float
    settle_s: float
    test_s: float
    penetration_m: NonNegative
    pairs: tuple[ContactPair, ...]
    drift_m: NonNegative
    drift_rad: NonNegative
    peak_speed_m_s: NonNegative
    joints: tuple[JointMotion, ...]
    settle_motion: dict[str, float]
    finite: bool
    console: tuple[str, ...] = ()
