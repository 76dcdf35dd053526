"""Which files of a dataset are read, from where, and how far what they say of an object's physics is believed."""

from collections.abc import Sequence
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator

from schemas.base import Frozen, Positive
from schemas.location import Location
from schemas.vocabulary import Keep, Quantity, Trust

KEEP_WORDS = (*Keep, *Quantity)
"""Words of ``--keep``: one of ``Keep`` for all quantities, or the quantities that stay as their file has them."""
KEPT_AS_ASKED = "its size is kept, as asked"
"""Why lengths count as metres where nothing but the user says so."""
MASSES_FIT = "its masses fit its volumes in metres"
"""Why they do where it is weighed: at another size it would be as light as air or heavier than lead."""
UNLIKE_UNITS = "its size is none to which datasets bring their objects"
"""Why they do where no more is known of them, unless that is no size for its kind."""


def keep_words(said: str | Sequence[str]) -> tuple[str, ...]:
    """The words of ``--keep``, of a text with commas or blanks between them. Raises ValueError for one that is none,
    and for ``nothing`` beside others."""
    words = said.replace(",", " ").split() if isinstance(said, str) else said
    for word in words:
        if word not in KEEP_WORDS:
            raise ValueError(f"'{word}' is none of {', '.join(KEEP_WORDS)}")
    if not words or (Keep.NOTHING in words and len(words) > 1):
        raise ValueError(f"it names {'nothing beside others' if words else 'nothing'}; choose what is kept")
    return tuple(dict.fromkeys(map(str, words)))


KeepWords = Annotated[tuple[str, ...], BeforeValidator(keep_words)]


def kept_share(words: tuple[str, ...], quantity: Quantity) -> Keep:
    """How much of one quantity is kept by these words: all that is not impossible where they name it, else what is
    plausible where they say so."""
    if Keep.ALL in words or quantity in words:
        return Keep.ALL
    return Keep.PLAUSIBLE if Keep.PLAUSIBLE in words else Keep.NOTHING


class Belief(Frozen):
    """How far one number of a file is believed, and why."""

    trust: Trust
    reason: str


class Authored(Belief):
    """The same of all numbers of one quantity that are judged alike: ``of`` these links or joints, of none where it is
    the whole object's."""

    quantity: Quantity
    of: tuple[str, ...] = ()


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
    """Largest mesh file that is read, MB: an OBJ of this size holds four million triangles, and reading it takes ten
    times its size in memory."""

    @property
    def package_folders(self) -> dict[str, str]:
        """Package's name → its folder, or its URL."""
        return {name: place for name, _, place in (package.partition("=") for package in self.packages)}
