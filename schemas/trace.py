"""One step of refinement."""

from schemas.base import Frozen


class TraceStep(Frozen):
    """One proposal and what the simulator said of it. Φ in metres; ``moved`` maps joint → new position (rad or m).

    ``proposer``: ``request`` (a search begins at the requested state), ``line``, ``perturbation`` and ``grid`` (the
    search), ``return`` (a mended pose goes back towards the requested one while Φ stays as low as wanted),
    ``authored`` (a joint nobody asked for starts at its authored zero), ``model``, ``shape`` (hulls cut or decomposed),
    ``range`` (hulls cut, or limits shortened, so that joints can move), ``mend`` (terms changed because a test failed:
    ``test`` names engine, test and subject, ``value_before`` and ``value_after`` what it measured).
    """

    step: int
    proposer: str
    phi_before_m: float
    phi_after_m: float
    moved: dict[str, float]
    accepted: bool
    evaluations: int
    reason: str
    test: str | None = None
    value_before: float | None = None
    value_after: float | None = None
