"""The offline model's answer to a prompt, from the prompt's text alone, which is what any model gets."""

import json

from asset2sim.models.language.object_info import ObjectInfo, read_prompt, read_refinement
from asset2sim.models.prior.overlay import synthesize
from asset2sim.models.prior.refinement import refine_state


def answer(text: str) -> str:
    """The JSON answer to a prompt: an ``Overlay``, or for purpose "refinement" the keys state_ok, approved and deltas.

    For the purposes "direct" and "ivw" the overlay has final numbers, for "ivw" with their standard deviations. Works
    from ``text`` alone, never raises, and the same text always gives the same answer. A text without the two blocks is
    answered as an object of which nothing is known.
    """
    information, guidance = read_prompt(text)
    purpose = information.get("purpose")
    if purpose == "refinement":
        return json.dumps(refine_state(read_refinement(information)), sort_keys=True)
    info = ObjectInfo.from_json(information)
    if purpose in ("direct", "ivw"):
        from asset2sim.models.prior.direct import propose  # rarely wanted, and it loads numerics

        return propose(info, guidance, purpose == "ivw").model_dump_json(exclude_none=True)
    return synthesize(info, guidance).model_dump_json(exclude_none=True)
