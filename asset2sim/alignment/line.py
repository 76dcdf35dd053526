"""One line on how near a run is to what was asked, and to the experts."""

import math
from collections.abc import Sequence

from schemas.alignment import Alignment


def alignment_line(found: Sequence[Alignment]) -> str:
    """Prompt alignment, and mean deviations from the expert reference where there is one; "" of nothing."""
    if not found:
        return ""
    line = f"prompt alignment {100.0 * mean([item.value for item in found]):.1f} % over {len(found)} assets"
    judged = [item.judged.value for item in found if item.judged is not None]
    if judged:
        line += f", by the judge {100.0 * mean(judged):.1f} % over {len(judged)}"
    every = [(item.scale_deviation, item.reference_states_scale) for item in found]
    scales = [(value, stated) for value, stated in every if value is not None]
    if not scales:
        return line
    stated = [value for value, is_stated in scales if is_stated]
    line += "; off the expert reference: "
    if stated:
        line += f"scale {100.0 * mean(stated):.1f} % over {len(stated)}"
    if len(stated) < len(scales):
        everyone = 100.0 * mean([value for value, _ in scales])
        line += (
            f"{' (' if stated else 'scale '}{everyone:.1f} % over {len(scales)}, those whose reference states no scale "
            f"included{')' if stated else ''}"
        )
    for slider, what in ((False, "rad over {} hinges"), (True, "m over {} sliders")):
        off = [
            item.joint_deviation
            for item in found
            if item.joint_deviation is not None and item.joint_is_slider is slider
        ]
        if off:
            line += f"{', ' if slider else '; first joint position '}{mean(off):.3g} {what.format(len(off))}"
    return line


def mean(values: Sequence[float]) -> float:
    """The mean, or not-a-number of nothing."""
    return math.fsum(values) / len(values) if values else math.nan
