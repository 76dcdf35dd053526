"""The whole overlay for one object: scale, links, joints and asked states, with notes on what each came from."""

from asset2sim.models.language.lexicon import segments
from asset2sim.models.language.object_info import ObjectInfo
from asset2sim.models.language.parts import parts_of
from asset2sim.models.language.sizing import identify, propose_scale
from asset2sim.models.language.states import asked_states
from asset2sim.models.prior.dynamics import propose_joints
from asset2sim.models.prior.masses import propose_links
from schemas.overlay import Overlay


def synthesize(info: ObjectInfo, guidance: str) -> Overlay:
    """An overlay for any object and any guidance, from the tables; deterministic."""
    size, category_note = identify(info, guidance)
    thoughts = segments(guidance, size.category)
    parts = parts_of(info, size.category)
    scale = propose_scale(info, size, guidance, thoughts)
    states = asked_states(info, parts, thoughts, scale.value)
    links, mass_notes = propose_links(info, size, parts, thoughts, guidance, scale.value, scale.final_m)
    joints, feel_notes = propose_joints(info, parts, thoughts, states.positions)
    return Overlay(
        scale=scale.value,
        contact_material=size.contact,
        links=links,
        joints=joints,
        initial_joint_positions=states.positions,
        asked=(*(("scale",) if scale.asked else ()), *states.positions),
        notes=(category_note, scale.note, *states.notes, *mass_notes, *feel_notes),
    )
