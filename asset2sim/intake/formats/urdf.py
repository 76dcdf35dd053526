"""URDF itself: read as it is."""

from pathlib import Path

from asset2sim.assets.urdf.document import parse_xml
from asset2sim.assets.urdf.references import AllowedFolders
from asset2sim.intake.formats.format import Converted, Format


def parsed_urdf(file: Path, work: Path, reach: AllowedFolders) -> Converted:
    """The URDF itself. Raises AssetError: unreadable_asset."""
    robot, recovered = parse_xml(file, "URDF")
    return Converted(robot, notes=recovered)


FORMAT = Format("URDF", ".urdf", 0, parsed_urdf, preferred="mobility.urdf", metric=False)
"""The name of PartNet-Mobility's files is preferred."""
