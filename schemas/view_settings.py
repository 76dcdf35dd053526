"""Settings of the pictures that a run writes beside what it refines."""

from pydantic import Field

from schemas.base import Frozen


class ViewSettings(Frozen):
    """The five canonical views."""

    width: int = Field(320, ge=16)
    height: int = Field(320, ge=16)
    write: bool = True
    """Whether views of the refined state are written beside it."""
    later: bool = False
    """Whether these are left to ``asset2sim views``, once the run is over: they take a fifth of an asset's time."""

    @property
    def in_run(self) -> bool:
        """Whether a run writes them."""
        return self.write and not self.later
