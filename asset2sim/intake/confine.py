"""A URDF all of whose files lie within reach: what lies outside is taken out of it before anything else reads it."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.mesh_files import (
    convert_to_obj,
    is_there,
    library_problem,
    material_files,
    without_materials,
)
from asset2sim.assets.urdf.references import AllowedFolders, Refused, find_mesh, find_within, lies_outside, path_in
from asset2sim.storage.regular_files import file_problem
from schemas.finding import Finding, remark, warning
from schemas.vocabulary import Stage

NOT_READ = "not_read"
"""Folder of the names that stand for references that are not read; there is none of that name."""


@dataclass
class Confined:
    """Files that a URDF's references mean within reach: ``names`` maps each reference to the file that it means, or to
    a name that means none, of which ``refused`` says why. ``moved`` says that a later reader would take one for another
    file, so that the URDF has to be written anew."""

    names: dict[str, str] = field(default_factory=dict)
    refused: dict[str, Refused] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    moved: bool = False

    def refuse(self, reference: str, problem: str) -> None:
        """Have a reference mean no file."""
        name = f"{NOT_READ}/{len(self.refused)}/{PurePosixPath(path_in(reference)).name}"
        self.refused[name] = Refused(reference, problem)
        self.names[reference], self.moved = name, True


def confine(robot: Element, file: Path, reach: AllowedFolders, work: Path) -> Confined:
    """The files that the references of a URDF mean within ``reach``; ``file`` is where they are relative to. Meshes
    that name pictures or materials outside are copied into ``work`` without them."""
    found = Confined()
    for element, reference in references(robot):
        if reference in found.names:
            continue
        inside, outside = find_within(reference, file.parent, reach)
        if inside is not None:
            found.moved |= find_mesh(reference, file.parent) != inside
            found.names[reference] = str(inside.resolve())
            stated = zip(reversed(PurePosixPath(path_in(reference)).parts), reversed(inside.parts), strict=False)
            if any(name != other and name.casefold() == other.casefold() for name, other in stated):
                message = (
                    f"'{reference}' is read from '{inside.parent.name}/{inside.name}': mend the case of its letters"
                )
                found.findings.append(remark(Stage.EXTRACT, "spelt_otherwise", message))
            if etree.QName(element).localname == "mesh":
                leave_materials(element, reference, inside, reach, work, found)
        elif outside is not None:
            found.refuse(reference, lies_outside(outside, reach))
    return found


def references(robot: Element) -> Iterator[tuple[Element, str]]:
    """The elements of a URDF that name files, with what they name, whatever namespace they are in."""
    for element in robot.iter(etree.Element):
        reference = element.get("filename")
        if reference is not None and etree.QName(element).localname in ("mesh", "texture"):
            yield element, reference


def rename(robot: Element, confined: Confined) -> None:
    """Point the references of a URDF at the files that they mean."""
    for element, reference in references(robot):
        if reference in confined.names:
            element.set("filename", confined.names[reference])


def leave_materials(
    element: Element, reference: str, mesh: Path, reach: AllowedFolders, work: Path, confined: Confined
) -> None:
    """Have a mesh replaced by a copy without its materials, and say so, where these or pictures of theirs lie outside,
    or are pipes, devices or the like, at which engines would read for ever."""
    looks = material_files(mesh, reach.allows, is_there)
    path, code, problem = next(
        (found for item in looks if (found := why_unfit(item, reach)) is not None), (mesh, "", "")
    )
    if not problem:
        return
    place = work / "meshes" / str(len(confined.names)) / mesh.name
    place.parent.mkdir(parents=True, exist_ok=True)
    if mesh.suffix.lower() == ".obj":
        place.write_bytes(without_materials(mesh.read_bytes()))
    else:
        try:
            # trimesh reads what a mesh names in the mesh's own folder alone.
            place = work / convert_to_obj(mesh, work, place.relative_to(work).as_posix())
        except Exception:  # a loader raises whatever its format's parser raises: it does not do without what is outside
            confined.refuse(reference, f"needs '{path.name}', which {problem}")
            return
    confined.names[reference], confined.moved = str(place), True
    link = next(
        (str(item.get("name")) for item in element.iterancestors() if etree.QName(item).localname == "link"), None
    )
    message = f"mesh '{reference}' of link '{link}' goes without materials: '{path.name}' {problem}"
    confined.findings.append(warning(Stage.EXTRACT, code, message, link=link))


def why_unfit(path: Path, reach: AllowedFolders) -> tuple[Path, str, str] | None:
    """A material library or picture that must not be read, with a finding's code and why, in words that follow its
    name; None for one that may."""
    if not reach.allows(path):
        return path, "outside_dataset", lies_outside(path, reach)
    problem = library_problem(path) if path.suffix.lower() == ".mtl" else file_problem(path)
    return None if problem is None else (path, "materials_unusable", f"{problem}: replace it by a file")
