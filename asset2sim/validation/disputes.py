"""A model that disagrees with a number of the file that it was told: which of the two stands, and why. Pure."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from schemas.authored import Belief
from schemas.finding import Notes
from schemas.overlay import Disagreement, JointProposal, LinkProposal, Overlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Keep, Quantity, Trust

Judge = Callable[[float], Belief]
"""Belief in another value of the same number."""
FIELDS: Mapping[Quantity, str] = {
    Quantity.MASS: "mass_kg", Quantity.DAMPING: "damping", Quantity.FRICTION: "friction", Quantity.SPRINGS: "stiffness",
}  # fmt: skip
"""Quantity → the field of a proposal that holds it."""
JOINTS = frozenset((Quantity.DAMPING, Quantity.FRICTION, Quantity.SPRINGS))
"""Those that joints have."""


@dataclass
class Disputes:
    """A model's objections to numbers of a file, by (quantity, link or joint; "" for the object): ``stands`` collects
    the values that go before the file's, ``notes`` a finding for each."""

    said: Mapping[tuple[Quantity, str], Disagreement]
    settings: PhysicsSettings
    notes: Notes = field(default_factory=Notes)
    stands: dict[tuple[Quantity, str], float] = field(default_factory=dict)

    @classmethod
    def of(cls, overlay: Overlay, settings: PhysicsSettings) -> "Disputes":
        """Those of an answer; the last counts where it names a number twice."""
        every = [(Quantity(item.quantity), item) for item in overlay.disagrees]
        said = {(quantity, "" if quantity is Quantity.SIZE else item.about): item for quantity, item in every}
        return cls(said, settings)

    def settle(self, quantity: Quantity, name: str, stated: float, belief: Belief, judge: Judge, keep: Keep) -> Belief:
        """The belief in a stated number after what the model said of it.

        The model's number stands where the file's is not believed anyway, and against a plausible one where it is
        further off than ``disputed_factor``, gives a reason and is itself plausible. What the user keeps by name, and
        a size in metres, stays.
        """
        said = self.said.get((quantity, name))
        if said is None:
            return belief
        theirs, factor = judge(said.value), self.settings.disputed_factor
        near = min(abs(stated), abs(said.value)) * factor >= max(abs(stated), abs(said.value))
        if keep is Keep.ALL:
            return self.note(said, stated, belief, "the file's stays, being kept as asked")
        if belief.trust is not Trust.PLAUSIBLE:
            if theirs.trust is Trust.PLAUSIBLE:
                self.stands[quantity, name] = said.value
                return self.note(said, stated, belief, f"the model's stands, as the file's is {belief.reason}")
            return self.note(said, stated, belief, f"neither stands: {belief.reason}; of the model's, {theirs.reason}")
        if theirs.trust is not Trust.PLAUSIBLE:
            return self.note(said, stated, belief, f"the file's stays: of the model's, {theirs.reason}")
        if near or not said.why.strip():
            why = f"they are within {factor:g} times" if near else "the model gives no reason"
            return self.note(said, stated, belief, f"the file's stays: {why}")
        self.stands[quantity, name] = said.value
        told = Belief(trust=Trust.DOUBTFUL, reason=f"the model states {said.value:.4g}: {said.why}")
        return self.note(said, stated, told, f"the model's stands: plausible, and over {factor:g} times off")

    def note(self, said: Disagreement, stated: float, belief: Belief, outcome: str) -> Belief:
        """The belief, with a finding on the two numbers."""
        place: dict[str, str] = {}
        if said.about:
            place = {"joint" if Quantity(said.quantity) in (*JOINTS, Quantity.START) else "link": said.about}
        whose = f" of '{said.about}'" if said.about else ""
        message = (
            f"the model disputes the {said.quantity}{whose}: {stated:.4g} in the file, {said.value:.4g} by the model "
            f"({said.why or 'no reason given'}); {outcome}"
        )
        self.notes.warn("authored_disputed", message, value=stated, limit=said.value, **place)
        return belief

    def refuse_size(self, metric: str) -> None:
        """A finding where the model disputes the size of a file that is ``metric``: a user has to ask for another."""
        said = self.said.get((Quantity.SIZE, ""))
        if said is not None and metric:
            why = f"the file's stays: {metric}, and another size is the user's to ask for"
            self.note(said, 1.0, Belief(trust=Trust.PLAUSIBLE, reason=metric), why)

    @property
    def of_contact(self) -> float | None:
        """The model's coefficient of contacts, where it stands; the largest of several."""
        found = [value for (quantity, _), value in self.stands.items() if quantity is Quantity.CONTACT]
        return max(found, default=None)

    def applied(self, overlay: Overlay) -> Overlay:
        """The answer with the numbers that stand in their places."""
        links = {item.name: item for item in overlay.links}
        joints = {item.name: item for item in overlay.joints}
        starts = dict(overlay.initial_joint_positions)
        for (quantity, name), value in self.stands.items():
            if quantity is Quantity.MASS:
                links[name] = links.get(name, LinkProposal(name=name)).model_copy(update={"mass_kg": value})
            elif quantity in JOINTS:
                before = joints.get(name, JointProposal(name=name))
                joints[name] = before.model_copy(update={FIELDS[quantity]: value})
            elif quantity is Quantity.START:
                starts.setdefault(name, value)
        update = {"links": tuple(links.values()), "joints": tuple(joints.values())}
        return overlay.model_copy(update={**update, "initial_joint_positions": starts})
