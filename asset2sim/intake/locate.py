"""The files in a folder that describe assets."""

import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path, PurePosixPath

from asset2sim.assets.urdf.references import MOST_DESCRIBED, PARENTS_SEARCHED
from asset2sim.intake.formats import FORMATS, NOT_MODELS, PREFERRED
from asset2sim.intake.formats.format import HEAD_BYTES, Format
from asset2sim.storage.regular_files import NOT_THERE, file_problem, folder_problem, is_file, path_problem, read_regular
from schemas.errors import AssetError
from schemas.vocabulary import FailureMode

_FIRST, *_MORE, _LAST = dict.fromkeys(form.name for form in FORMATS.values())
FURTHER = f"{', '.join(_MORE)} or {_LAST} file"
"""The formats after the first, in words: "xacro, SDF or MJCF file"."""
TELLING = tuple(suffix for suffix, form in FORMATS.items() if form.recognises is None)
"""Suffixes that tell a format by themselves."""
URDF_FOLDER = "urdf"
"""Folder in which ROS packages keep descriptions."""
SOURCE_SUFFIX = ".xacro"
"""Of files from which others, a URDF beside them, are made."""

PACKAGE_FILE = "package.xml"
"""The file that ROS's packages have at their top."""

Read = Callable[[str, int], bytes]
"""The first so many bytes of a file by its name. Raises OSError."""


def candidates(names: Iterable[str]) -> list[str]:
    """Of the names of files below an asset's folder, those that may describe assets by name alone: of the first suffix
    that there is, at the top, else in ``urdf``, else one folder down, with those beside them of another suffix and
    another name. A preferred name stands alone."""
    known = sorted(name for name in names if PurePosixPath(name).name not in NOT_MODELS and name.count("/") < 2)
    for suffix in FORMATS:
        for found in _by_place([name for name in known if name.endswith(suffix)]):
            preferred = [name for name in found if name in PREFERRED]
            if preferred:
                return preferred[:1]
            beside = [name for name in known if _folder(name) in map(_folder, found) and name not in PREFERRED]
            return [*found, *_others(found, beside)]
    return []


def _by_place(names: Sequence[str]) -> list[list[str]]:
    """The names at the top, those in ``urdf``, and all, as far as there are any."""
    places = [[name for name in names if _folder(name) == folder] for folder in ("", URDF_FOLDER)]
    return [found for found in (*places, list(names)) if found]


def _folder(name: str) -> str:
    return name.rpartition("/")[0]


def stem(name: str) -> str:
    """A file's name without folder and suffix; ``door`` of ``urdf/door.urdf.xacro`` as well."""
    known = next((suffix for suffix in FORMATS if name.endswith(suffix)), "")
    return PurePosixPath(name).name.removesuffix(known).removesuffix(".urdf")


def _others(found: Sequence[str], beside: Sequence[str]) -> list[str]:
    """Of files beside others those that describe something else: of a later format and another name; a xacro is what
    URDFs beside it are made of."""
    taken, more = {stem(name) for name in found}, list[str]()
    for suffix in FORMATS:
        fresh = [name for name in beside if name.endswith(suffix) and stem(name) not in taken]
        if suffix != SOURCE_SUFFIX or found[0].endswith(SOURCE_SUFFIX):
            more += fresh
            taken |= {stem(name) for name in fresh}
    return more


def descriptions(folder: str, names: Iterable[str], read: Read) -> list[str]:
    """Of the names of files below a ``folder`` of this name those that each describe an asset, by what they hold where
    names do not tell. Raises OSError."""
    left = list(names)
    while found := candidates(left):
        chosen = sorted(name for form, group in _grouped(found) for name in _told_apart(form, folder, group, read))
        if chosen:
            return chosen
        left = [name for name in left if name not in found]
    return []


def _grouped(names: Sequence[str]) -> list[tuple[Format, list[str]]]:
    forms = list({form.name: form for form in FORMATS.values()}.values())
    groups = [(form, [name for name in names if name.endswith((form.suffix, *form.further))]) for form in forms]
    return [(form, group) for form, group in groups if group]


def _told_apart(form: Format, folder: str, names: list[str], read: Read) -> list[str]:
    """The files of one format among those that have its suffix, without what they only include."""
    if form.recognises is not None:
        names = [name for name in names if form.recognises(read(name, HEAD_BYTES))]
    if form.of_several is None or len(names) < 2:
        return names
    above = f"{folder}/"
    texts = {above + name: read(name, MOST_DESCRIBED).decode(errors="replace") for name in names}
    return [name.removeprefix(above) for name in form.of_several(texts)]


def split_url(url: str) -> tuple[str, str]:
    """The URL of a folder, and the name of the file that is named in it, empty where the URL is a folder's."""
    folder, _, name = url.rpartition("/")
    is_named = PurePosixPath(name).suffix in FORMATS and not folder.endswith("/")
    return (folder, name) if is_named else (url, "")


def package_of(folder: Path) -> Path:
    """The ROS package's folder of which this one is a part: with a package.xml, or above ``urdf``; else itself."""
    places = (folder, *folder.parents[:PARENTS_SEARCHED])
    above = next((place for place in places if is_file(place / PACKAGE_FILE)), None)
    return above or (folder.parent if folder.name == URDF_FOLDER else folder)


def find_source(place: Path, within: Callable[[Path], bool] = lambda path: True) -> Path:
    """The file that describes an asset: the place itself, or in an asset's folder ``mobility.urdf`` or its only URDF,
    else a file of another format.

    Files that are not ``within`` are not looked into; one of them is returned where there is no other.
    Raises AssetError (unreadable_asset) if there is none or more than one, or if it is no regular file.
    """
    if is_file(place):
        return _stated(place)
    problem = folder_problem(place)
    if problem == NOT_THERE:
        raise _unfit(place, "missing_folder", "no such asset folder; mend the manifest's path")
    if problem is not None:
        raise _unfit(place, "unreadable_folder", f"the asset's folder {problem}; mend it, or take it out")
    try:
        names = _names_in(place)
        problems = {name: file_problem(place / name) for name in names}
        usable = [name for name in names if problems[name] is None]
        known = candidates(usable)
        if not known and (unusable := candidates(names)):
            raise _unfit(place, "not_a_file", f"{unusable[0]} {problems[unusable[0]]}; put the file itself there")
        inside = [name for name in usable if within(place / name)]
        if known and not candidates(inside):
            return place / known[0]
        return _single(
            place,
            descriptions(place.resolve().name, inside, lambda name, most: read_regular(place / name, most)),
            names,
        )
    except OSError as error:
        raise _unfit(place, "unreadable_file", f"{error.filename} {path_problem(place, error)}; mend it") from error


def _stated(file: Path) -> Path:
    """A file that a user names. Raises AssetError where its ending is no format's."""
    if file.suffix in FORMATS:
        return file
    raise _unfit(file, "no_single_urdf", f"its ending is none of {', '.join(FORMATS)}; name a file that describes an "
                 "asset, or the folder of one")  # fmt: skip


def _single(folder: Path, found: Sequence[str], names: Iterable[str]) -> Path:
    """The one file of those that describe an asset. Raises AssetError."""
    if len(found) == 1:
        return folder / found[0]
    if not found:
        problem = f"no {_FIRST} file, nor a {FURTHER}"
        capitals = [name for name in names if not name.endswith((*FORMATS,)) and name.lower().endswith(TELLING)]
        problem += f"; write the ending of {capitals[0]} in small letters" if capitals else ""
    else:
        forms = [form for form, _ in _grouped(found)]
        kinds = " and ".join(form.name for form in forms)
        problem = f"{len(found)} {kinds} files ({', '.join(found[:5])}); name one of them, or keep one"
    raise _unfit(folder, "no_single_urdf", problem)


def _unfit(folder: Path, code: str, problem: str) -> AssetError:
    return AssetError(FailureMode.UNREADABLE_ASSET, code, f"{folder}: {problem}")


def _names_in(folder: Path) -> list[str]:
    """Names of the files in a folder that may describe an asset by their ending, and in the folders one below it."""
    found: list[str] = []
    folders = [""]
    for below in folders:
        try:
            with os.scandir(folder / below) as entries:
                for entry in entries:
                    name = f"{below}/{entry.name}" if below else entry.name
                    if entry.name.lower().endswith((*FORMATS,)):
                        found.append(name)
                    if not below and os.path.isdir(entry.path):
                        folders.append(name)
        except OSError:
            if not below:
                raise
    return sorted(found)
