"""Result of a scripted arm with a refined object, where a run asks for that check."""

from schemas.base import Fraction, Frozen


class Reached(Frozen):
    """Result of a scripted arm with an object. ``share``: of the way of its task, 0 to 1, on which it moved the joint;
    None where nothing was moved, of which ``reason`` says why; else it says what is amiss, and is empty if nothing."""

    task: str = ""
    joint: str | None = None
    share: Fraction | None = None
    reason: str = ""

    @property
    def columns(self) -> dict[str, float | str | None]:
        """Column of the table ``assets`` → its value."""
        return {
            "reachable": self.share,
            "reachable_task": " ".join(filter(None, (self.task, self.joint))) or None,
            "reachable_reason": self.reason or None,
        }
