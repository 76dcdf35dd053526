"""The tree of an XML file, parsed once for each content that the file has had."""

from functools import lru_cache
from pathlib import Path

from lxml import etree
from lxml.etree import _Element as Element

KEPT = 8
"""Trees that are kept: an asset's own, and those of the last few URDFs that were written of it."""


def parsed(file: Path) -> Element:
    """The root element of a file as it is now, comments kept; shared, so not to be changed: copy it first. Raises
    OSError and etree.XMLSyntaxError."""
    return _parsed(file.read_bytes())


@lru_cache(maxsize=KEPT)
def _parsed(content: bytes) -> Element:
    return etree.fromstring(content, etree.XMLParser(remove_comments=False))
