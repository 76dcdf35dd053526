"""URDF itself: read as it is."""

from pathlib import Path

from asset2sim.assets.urdf.document import parse_xml
from asset2sim.assets.urdf.references import AllowedFolders
from asset2sim.intake.formats.format import Converted, Format, add_child

WORLD = "world"
"""Drake's name for the world, which needs no link there."""


def parsed_urdf(file: Path, work: Path, reach: AllowedFolders) -> Converted:
    """The URDF itself, with the link ``world`` where joints hang on it and no link is called so, as Drake's files have
    it. Raises AssetError: unreadable_asset."""
    robot, recovered = parse_xml(file, "URDF")
    hangs = any(parent.get("link") == WORLD for parent in robot.iterfind("{*}joint/{*}parent"))
    if hangs and all(link.get("name") != WORLD for link in robot.iterfind("{*}link")):
        add_child(robot, "link", name=WORLD)
        recovered = (*recovered, f"its joints hang on '{WORLD}', which is no link of it: it is added")
    return Converted(robot, notes=recovered)


FORMAT = Format("URDF", ".urdf", 0, parsed_urdf, preferred="mobility.urdf", metric=False)
"""The name of PartNet-Mobility's files is preferred."""
