"""Press forces that neither tip nor slide the object that is pressed."""

from asset2sim.validation.handling import Handling
from asset2sim.validation.notes import Notes
from schemas.overlay import JointProposal
from schemas.settings import PhysicsSettings


def bounded_press(
    proposal: JointProposal, kind: Handling, outward: float, settings: PhysicsSettings, notes: Notes
) -> JointProposal:
    """The proposal with its press forces lowered together so that none exceeds ``press_margin`` of what tips or slides
    the object when the part is pressed towards ``outward`` (±1)."""
    stated = {name: getattr(proposal, name) for name in ("press_start", "press_end")}
    largest = max((value for value in stated.values() if value is not None), default=0.0)
    most = settings.press_margin * (kind.tips_upward if outward > 0.0 else kind.tips_downward)
    if largest <= most:
        return proposal
    message = (
        f"joint '{proposal.name}': a press of {largest:.3g} N would tip or slide the object; its spring is made for "
        f"{most:.3g} N"
    )
    notes.info("press_bounded", message, joint=proposal.name, value=largest, limit=most)
    lowered = {name: None if value is None else value * most / largest for name, value in stated.items()}
    return proposal.model_copy(update=lowered)
