"""The file in a folder that describes an asset."""

import os
import re
from collections.abc import Callable, Iterable
from pathlib import Path, PurePosixPath

from asset2sim.assets.urdf.references import MOST_DESCRIBED
from asset2sim.intake.formats import FORMATS, NOT_MODELS, PREFERRED
from asset2sim.intake.formats.format import HEAD_BYTES
from asset2sim.storage.regular_files import NOT_THERE, file_problem, folder_problem, path_problem, read_regular
from schemas.errors import AssetError
from schemas.vocabulary import FailureMode

_INCLUDED = re.compile(r"""(?:<(?:xacro:)?include\s[^>]*?file(?:name)?\s*=\s*["']|@(?=[^@\n]*\.usd[acz]?@))([^"'@]+)""")
_FIRST, *_MORE, _LAST = dict.fromkeys(form.name for form in FORMATS.values())
FURTHER = f"{', '.join(_MORE)} or {_LAST} file"
"""The formats after the first, in words: "xacro, SDF or MJCF file"."""
TELLING = tuple(suffix for suffix, form in FORMATS.items() if form.recognises is None)
"""Suffixes that tell a format by themselves."""


def candidates(names: Iterable[str]) -> list[str]:
    """Of the names of files below an asset's folder, those that may describe it: of the first suffix that there is, at
    the top, else one folder down. A preferred name stands alone."""
    known = [name for name in names if PurePosixPath(name).name not in NOT_MODELS]
    for suffix in FORMATS:
        for depth in (0, 1):
            found = sorted(name for name in known if name.endswith(suffix) and name.count("/") == depth)
            if found:
                return [name for name in found if name in PREFERRED][:1] or found
    return []


def find_source(folder: Path, within: Callable[[Path], bool] = lambda path: True) -> Path:
    """The file that describes an asset: ``mobility.urdf`` or its only URDF, else a file of another format.

    Of several files of a format it is the one that ``Format.of_several`` finds. Files that are not ``within`` are
    not looked into; one of them is returned where there is no other.
    Raises AssetError (unreadable_asset) if there is none or more than one, or if it is no regular file.
    """
    problem = folder_problem(folder)
    if problem == NOT_THERE:
        raise _unfit(folder, "missing_folder", "no such asset folder; mend the manifest's path")
    if problem is not None:
        raise _unfit(folder, "unreadable_folder", f"the asset's folder {problem}; mend it, or take it out")
    try:
        names = _names_in(folder)
        problems = {name: file_problem(folder / name) for name in names}
        found = candidates(name for name in names if problems[name] is None)
        if not found and (unusable := candidates(names)):
            raise _unfit(folder, "not_a_file", f"{unusable[0]} {problems[unusable[0]]}; put the file itself there")
        inside = [folder / name for name in found if within(folder / name)]
        return folder / found[0] if found and not inside else _single(folder, inside, names)
    except OSError as error:
        raise _unfit(folder, "unreadable_file", f"{error.filename} {path_problem(folder, error)}; mend it") from error


def _single(folder: Path, found: list[Path], names: Iterable[str]) -> Path:
    """The one file of those that may describe an asset. Raises AssetError and OSError."""
    form = FORMATS.get(found[0].suffix) if found else None
    if form is not None and form.recognises is not None:
        found = [file for file in found if form.recognises(read_regular(file, HEAD_BYTES))]
    if form is not None and len(found) > 1:
        found = form.of_several({file: _included(file) for file in found})
    if len(found) == 1:
        return found[0]
    listed = ", ".join(str(path.relative_to(folder)) for path in found[:5])
    if form is None or not found:
        problem = f"no {_FIRST} file, nor a {FURTHER}"
        capitals = [name for name in names if not name.endswith((*FORMATS,)) and name.lower().endswith(TELLING)]
        problem += f"; write the ending of {capitals[0]} in small letters" if capitals else ""
    else:
        name = form.preferred
        problem = f"{len(found)} {form.name} files ({listed}); keep one" + (f" or name it {name}" if name else "")
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


def _included(file: Path) -> set[str]:
    """Names of the files that a file includes, as xacro, MJCF and USD do."""
    text = read_regular(file, MOST_DESCRIBED).decode("utf-8", errors="replace")
    return {re.split(r"[/\\]", path)[-1] for path in _INCLUDED.findall(text)}
