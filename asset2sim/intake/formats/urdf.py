"""URDF itself: read as it is."""

from pathlib import Path

from lxml import etree

from asset2sim.assets.urdf.document import unreadable
from asset2sim.assets.urdf.references import AllowedFolders
from asset2sim.intake.formats.format import Converted, Format


def parsed_urdf(file: Path, work: Path, reach: AllowedFolders) -> Converted:
    """The URDF itself. Raises AssetError: unreadable_asset."""
    try:
        return Converted(etree.parse(str(file)).getroot())
    except (etree.XMLSyntaxError, OSError, UnicodeError) as error:
        raise unreadable(file, "not_xml", f"not readable as XML ({error}); export the URDF again") from error


FORMAT = Format("URDF", ".urdf", 0, parsed_urdf, preferred="mobility.urdf")
"""The name of PartNet-Mobility's files is preferred."""
