"""Trivial baseline: one constant scale and every joint a tenth open, whatever the object and the words; no model call.

It shows what a score of meaning is worth: our rules and checks complete it as they do a model's answer.
"""

from asset2sim.assets.extract import Extraction
from asset2sim.baselines.declared_method import DOTTED, DeclaredMethod, ProposalJob, Proposed
from schemas.features import Features
from schemas.overlay import Overlay
from schemas.request import ModelAnswer, ModelAsk, ModelRequest
from schemas.vocabulary import Method, Source

SCALE = 0.2
"""The scale that GenSim2's experts give most often, so that the baseline is as strong as a constant can be."""
OPEN_SHARE = 0.1
"""Share of its range by which every joint is open."""


def propose_constant(features: Features) -> Overlay:
    """The overlay of any object: the constant scale, and joint positions in rad, or m at scale 1."""
    positions = {
        joint.name: joint.closed + OPEN_SHARE * (joint.open - joint.closed)
        for joint in features.movable_joints
        if joint.closed is not None and joint.open is not None and joint.open != joint.closed
    }
    note = f"scale {SCALE:g} and every joint {OPEN_SHARE:.0%} open, as for every object"
    return Overlay(scale=SCALE, initial_joint_positions=positions, notes=(note,))


def without_model(request: ModelRequest) -> ModelAnswer:
    """No answer: this method asks no model, not even for a step of the state."""
    return ModelAnswer(content=None, calls=(), error=f"no model is asked for {request.purpose}")


def propose(job: ProposalJob, extraction: Extraction) -> Proposed:
    """The same scale and share open for every object."""
    return propose_constant(extraction.features), (), ()


def unasked(ask: ModelAsk, extraction: Extraction) -> tuple[ModelAsk, Extraction]:
    """No model, and all of the asset."""
    return without_model, extraction


METHOD = DeclaredMethod(
    Method.CONSTANT,
    "one constant scale, a tenth open",
    "one scale and every joint a tenth open for every object, with our rules",
    propose,
    place=70,
    rules=True,
    asks=False,
    source=Source.RULE,
    given=unasked,
    colour="#000000",
    dashes=DOTTED,
)
