"""Which files of a dataset are read, and from where."""

from typing import Annotated

from pydantic import AfterValidator

from schemas.authored import KeepWords
from schemas.base import Frozen, Positive
from schemas.location import Location
from schemas.vocabulary import Keep


def _package(text: str) -> str:
    name, separator, place = text.partition("=")
    if not (name.strip() and separator and place.strip()) or "/" in name:
        raise ValueError(f"'{text}' is not of the form NAME=PATH, a package's name and its folder")
    folder = Location(place.strip())
    return f"{name.strip()}={folder if folder.is_url else folder.folder.expanduser().absolute()}"


Package = Annotated[str, AfterValidator(_package)]
"""A package's name and its folder or URL, as NAME=PATH; a relative path is one of the working folder."""


class InputSettings(Frozen):
    """Which files are read."""

    keep: KeepWords = (Keep.PLAUSIBLE.value,)
    """Which authored numbers stay where no words of the user's ask otherwise: plausible, all, nothing, or the names of
    quantities that stay as they are: size, mass, centre, inertia, damping, friction, springs, limits,
    shapes."""
    allow_outside: bool = False
    """Whether files outside the dataset's folder are read: meshes, textures and what a file includes, named by paths
    that leave it or by symbolic links."""
    split: bool = False
    """Whether a file of several objects is cut into them, each an asset of its own."""
    packages: tuple[Package, ...] = ()
    """Folders outside it that are read all the same, as NAME=PATH: ``package://NAME/...`` means a file below PATH."""
    macro: str = ""
    """The macro that is read of xacro files that only define macros, its arguments at their defaults."""
    max_mesh_mb: Positive = 256.0
    """Largest mesh file that is read, MB: an OBJ of four million triangles, which takes ten times that in memory."""

    @property
    def package_folders(self) -> dict[str, str]:
        """Package's name → its folder, or its URL."""
        return {name: place for name, _, place in (package.partition("=") for package in self.packages)}
