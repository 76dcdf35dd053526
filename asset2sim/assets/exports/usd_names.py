"""Names of an object's links and joints as paths of USD prims."""

import re
from collections.abc import Iterable

from asset2sim.assets.exports.refined_object import ExportObject


class PrimPaths:
    """Prim paths: ``top`` of the object, ``links`` and ``joints`` by URDF name."""

    def __init__(self, item: ExportObject) -> None:
        self.top = f"/{identifier(item.name)}"
        self.links = paths(f"{self.top}", item.bodies, taken=("joints", "looks", "contact"))
        self.joints = paths(f"{self.top}/joints", (joint.name for joint in item.joints))


def paths(parent: str, names: Iterable[str], taken: Iterable[str] = ()) -> dict[str, str]:
    """Name → a path under ``parent``, no path twice."""
    used, found = set(taken), dict[str, str]()
    for name in names:
        base = word = identifier(name)
        number = 1
        while word in used:
            word, number = f"{base}_{number}", number + 1
        used.add(word)
        found[name] = f"{parent}/{word}"
    return found


def identifier(name: str) -> str:
    """The name with the characters replaced that a USD prim's name may not hold."""
    word = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return word if word and not word[0].isdigit() else f"_{word}"
