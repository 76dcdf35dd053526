"""The least inertia of a link beside the one that it moves on."""

from dataclasses import replace

import numpy as np

from asset2sim.validation.masses import LinkMass
from asset2sim.validation.notes import Notes
from schemas.features import Features
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source


def with_armature(
    masses: dict[str, LinkMass], features: Features, settings: PhysicsSettings, notes: Notes
) -> dict[str, LinkMass]:
    """Give links that move on far heavier ones the inertia of an armature: equal about every axis, masses unchanged.

    A key's 10⁻⁸ kg·m² beside a board's 10⁻² leave a solver in single precision nothing to work with. Each link gets at
    least the largest moment of the link that it moves on, divided by ``max_inertia_ratio``, and the reverse.
    """
    result = dict(masses)
    moments = {name: np.linalg.eigvalsh(item.inertia) for name, item in masses.items()}
    for joint in features.movable_joints:
        for thin, thick in ((joint.child, joint.parent), (joint.parent, joint.child)):
            least = float(moments[thick][-1]) / settings.max_inertia_ratio
            missing = least - float(moments[thin][0])
            if missing <= 0.0:
                continue
            notes.info(
                "inertia_ratio",
                f"link '{thin}': {missing:.3g} kg·m² added about every axis: it moves on '{thick}', whose inertia is "
                "more than engines handle beside it",
                link=thin,
                value=missing,
                limit=least,
            )
            tensor = result[thin].inertia + missing * np.eye(3)
            result[thin] = replace(result[thin], inertia=tensor, inertia_source=Source.RULE)
            moments[thin] = moments[thin] + missing
    return result
