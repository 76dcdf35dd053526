"""The offline model's answer to a prompt, from the prompt's text alone, which is what any model gets."""

import json

from asset2sim.guidance.lexicon import segments
from asset2sim.guidance.object_info import ObjectInfo, read_prompt
from asset2sim.guidance.parts import parts_of
from asset2sim.guidance.sizing import identify, propose_scale
from asset2sim.guidance.states import asked_states
from asset2sim.guidance.supports import said_support, usual_support
from asset2sim.models.prior.joint_proposals import propose_joints
from asset2sim.models.prior.link_proposals import propose_links
from asset2sim.models.prior.refinement import read_refinement, refinement_step
from schemas.overlay import Overlay


def answer(text: str) -> str:
    """The JSON answer to a prompt: an ``Overlay``, or for purpose "refinement" the keys state_ok, approved and deltas.

    For the purposes "direct" and "ivw" the overlay has final numbers, for "ivw" with their standard deviations. Works
    from ``text`` alone, never raises, and the same text always gives the same answer. A text without the two blocks is
    answered as an object of which nothing is known.
    """
    information, guidance = read_prompt(text)
    purpose = information.get("purpose")
    if purpose == "refinement":
        return json.dumps(refinement_step(*read_refinement(information)), sort_keys=True)
    info = ObjectInfo.from_json(information)
    overlay = prior_overlay(info, guidance)
    if purpose in ("direct", "ivw"):
        from asset2sim.models.prior.direct import final_overlay  # rarely wanted, and it loads numerics

        overlay = final_overlay(info, overlay, purpose == "ivw")
    return overlay.model_dump_json(exclude_none=True)


def prior_overlay(info: ObjectInfo, guidance: str) -> Overlay:
    """An overlay for any object and any guidance, from the tables; deterministic."""
    size, category_note = identify(info, guidance)
    statements = segments(guidance, size.category)
    parts = parts_of(info, size.category)
    scale = propose_scale(info, size, guidance, statements)
    states = asked_states(info, parts, statements, scale.value)
    links, mass_notes, change = propose_links(info, size, parts, statements, guidance, scale.value, scale.final_m)
    joints, feel_notes = propose_joints(info, parts, statements, states.positions)
    return Overlay(
        scale=scale.value,
        contact_material=size.contact,
        support=said_support(guidance) or usual_support(info, guidance),
        links=links,
        joints=joints,
        initial_joint_positions=states.positions,
        mass_change=change,
        asked=(*(("scale",) if scale.asked else ()), *states.positions),
        notes=(category_note, scale.note, *states.notes, *mass_notes, *feel_notes),
    )
