"""Links in circles, to nowhere and to the outside, and references that leave the dataset."""

import os
from collections.abc import Callable, Sequence

from tests.hostile.case import HANDLED, REFUSED, RULES, UNREADABLE, Case, Place
from tests.hostile.tiny import BODY, LID, MESHES, URDF, Write, asset, described, hinge, link, robot, write_files

OUTSIDE = "../../outside"
DTD = "<?xml version='1.0'?><!DOCTYPE robot [{}]>"


def cases() -> Sequence[Case]:
    """Links in the place of assets, folders and files, and references out of a dataset."""
    return [*_entries(), *_inner(), *_references(), *_roots()]


def _entries() -> list[Case]:
    """Links in the place of an asset's folder."""
    nowhere = {
        "itself": lambda place: place.asset.name,
        "nowhere": lambda place: "nowhere/at/all",
        "long_name": lambda place: "x" * 300,
        "long_path": lambda place: "/".join(["x"] * 1900),
        "into_itself": lambda place: f"{place.asset.name}/deeper",
        "through_file": lambda place: f"{place.asset.name}.txt/deeper",
        "absolute_itself": lambda place: str(place.asset),
    }
    found = [Case(f"entry_{name}", _link(target), UNREADABLE, "link") for name, target in nowhere.items()]
    found[3] = Case("entry_long_path", _link(nowhere["long_path"]), UNREADABLE)
    found[5] = Case("entry_through_file", _through_file, UNREADABLE)
    found += [
        Case("entry_pair_a", _link(lambda place: "entry_pair_b"), UNREADABLE, "leads back"),
        Case("entry_pair_b", _link(lambda place: "entry_pair_a"), UNREADABLE, "leads back"),
        Case("entry_chain", _chain(30), HANDLED),
        Case("entry_long_chain", _chain(60), UNREADABLE),
        Case("entry_outside", _link(lambda place: str(place.outside / "asset")), HANDLED, words=RULES),
        Case("entry_outside_relative", _link(lambda place: "../outside/asset"), HANDLED, words=RULES),
    ]
    return found


def _inner() -> list[Case]:
    """Links within an asset's folder."""
    folders = {"up": "..", "root": "/", "itself": MESHES, "proc": "/proc/self", "outside": OUTSIDE, "dataset": "../.."}
    found = [Case(f"meshes_{name}", _meshes(target), HANDLED, words=RULES) for name, target in folders.items()]
    # Beside good meshes: only listing goes there.
    found += [Case(f"beside_{name}", _beside(target), HANDLED, words=RULES) for name, target in folders.items()]
    files = {
        "urdf": (URDF, f"{OUTSIDE}/secret.xml"),
        "body": (BODY, f"../{OUTSIDE}/mesh.obj"),
        "body_text": (BODY, f"../{OUTSIDE}/secret.txt"),
        "library": (f"{MESHES}/look.mtl", f"../{OUTSIDE}/look.mtl"),
        "picture": (f"{MESHES}/red.png", f"../{OUTSIDE}/red.png"),
        "meta": ("meta.json", f"{OUTSIDE}/meta.json"),
        "semantics": ("semantics.txt", f"{OUTSIDE}/semantics.txt"),
        "annotation": ("mobility_v2.json", f"{OUTSIDE}/secret.txt"),
    }
    return found + [Case(f"file_{name}", _file(*pair), HANDLED, words=RULES) for name, pair in files.items()]


def _references() -> list[Case]:
    """Paths in files that lead out of the dataset."""
    meshes = {
        "dots": lambda place: f"{OUTSIDE}/mesh.obj",
        "dots_deep": lambda place: f"{MESHES}/../{OUTSIDE}/mesh.obj",
        "absolute": lambda place: str(place.outside / "mesh.obj"),
        "file_url": lambda place: f"file://{place.outside}/mesh.obj",
        "package_dots": lambda place: f"package://{OUTSIDE}/mesh.obj",
        "package_name": lambda place: "package://outside/mesh.obj",
        "model": lambda place: f"model://x/{OUTSIDE}/mesh.obj",
        "backslashes": lambda place: "..\\..\\outside\\mesh.obj",
        "percent": lambda place: "..%2f..%2foutside%2fmesh.obj",
        "home": lambda place: "~/mesh.obj",
        "variable": lambda place: "$HOME/mesh.obj",
        "find": lambda place: "$(find outside)/mesh.obj",
        "password_file": lambda place: "/etc/passwd",
        "environment": lambda place: "/proc/self/environ",
        "http": lambda place: "http://localhost:9/mesh.obj",
        "share": lambda place: "//outside/mesh.obj",
    }
    found = [Case(f"mesh_{name}", _referring(path), HANDLED, words=RULES) for name, path in meshes.items()]
    looks = {"dots": f"../{OUTSIDE}/red.png", "absolute": "/etc/passwd", "home": "~/red.png"}
    for name, path in looks.items():
        found.append(
            Case(f"picture_{name}", asset({f"{MESHES}/look.mtl": f"newmtl red\nmap_Kd {path}\n"}), HANDLED, words=RULES)
        )
    library = (
        f"mtllib ../{OUTSIDE}/look.mtl\nv 0 0 0\nv 0.2 0 0\nv 0 0.2 0\nv 0 0 0.2\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    )
    texture = f'<material name="m"><texture filename="{OUTSIDE}/red.png"/></material>'
    secret = "<!ENTITY x SYSTEM '{}'>"
    inside = robot(link("&x;", BODY), link("lid", LID), hinge(parent="&x;"))
    texts = {
        "library": asset({LID: library}),
        "texture": described(robot(texture, link("body", BODY), link("lid", LID), hinge())),
        "entity": _outer_entity(secret, inside),
        "entity_relative": described(DTD.format(secret.format(f"{OUTSIDE}/secret.txt")) + inside),
        "parameter": described(DTD.format(f"<!ENTITY % p SYSTEM '{OUTSIDE}/secret.xml'> %p;") + robot()),
        "doctype": described(f"<!DOCTYPE robot SYSTEM '{OUTSIDE}/secret.xml'>" + robot()),
        "xinclude": described(
            robot(
                f"<i:include xmlns:i='http://www.w3.org/2001/XInclude' href='{OUTSIDE}/secret.xml'/>",
                link("body", BODY),
            )
        ),
        "xacro_include": _xacro(f"<xacro:include filename='{OUTSIDE}/secret.xml'/>"),
        "xacro_yaml": _xacro(f"<link name=\"${{xacro.load_yaml('{OUTSIDE}/secret.yaml')['word']}}\"/>"),
        "xacro_environment": _xacro("<link name='$(env HOSTILE_KEY)'/>"),
        "sdf_uri": _only("model.sdf", _sdf(f"{OUTSIDE}/mesh.obj")),
        "mjcf_file": _only("model.xml", _mjcf(f"<mesh name='m' file='{OUTSIDE}/mesh.obj'/>")),
        "mjcf_include": _only("model.xml", f"<mujoco><include file='{OUTSIDE}/secret.xml'/></mujoco>"),
        "mjcf_meshdir": _only(
            "model.xml", _mjcf("<mesh name='m' file='mesh.obj'/>", f"<compiler meshdir='{OUTSIDE}'/>")
        ),
    }
    return found + [Case(f"text_{name}", write, HANDLED, words=RULES) for name, write in texts.items()]


def _roots() -> list[Case]:
    """Datasets that are, or hold, a link."""
    return [
        Case("only_circles", _only_circles, says="leads back to itself"),
        Case("manifest_itself", _manifest("manifest.csv"), says="leads back to itself"),
        Case("manifest_nowhere", _manifest("nowhere.csv"), says="which is not there"),
        Case("manifest_zero", _manifest("/dev/zero"), says="is a device, not a file"),
        Case("manifest_folder_link", _manifest("."), says="is a folder, not a file"),
        Case("row_itself", _circle, UNREADABLE, "leads back", row="row_itself,row_itself_link,,"),
        Case("row_deeper", lambda place: None, UNREADABLE, "leads back", row="row_deeper,row_itself_link/a/b,,"),
        Case("row_absolute", lambda place: None, REFUSED | HANDLED, row="row_absolute,/etc,,"),
        Case("row_up", lambda place: None, HANDLED, row="row_up,../outside/asset,,", words=()),
        Case(
            "row_file",
            lambda place: write_files(place.data, {"a_file": ""}),
            UNREADABLE,
            "its ending is none of",
            row="row_file,a_file,,",
        ),
        Case("row_long", lambda place: None, UNREADABLE, row=f"row_long,{'x' * 300},,"),
        Case("row_deep", lambda place: None, UNREADABLE, row=f"row_deep,{'/'.join('x' * 2400)},,"),
    ]


def _link(target: Callable[[Place], str]) -> Write:
    return lambda place: place.asset.symlink_to(target(place))


def _through_file(place: Place) -> None:
    place.asset.symlink_to("through_file.txt/deeper")
    (place.data / "through_file.txt").write_text("a file")


def _chain(length: int) -> Write:
    def write(place: Place) -> None:
        hidden = place.data / f".chain{length}"
        asset()(Place(place.data, hidden / "0", place.outside))
        for number in range(1, length):
            (hidden / str(number)).symlink_to(str(number - 1))
        place.asset.symlink_to(hidden / str(length - 1))

    return write


def _meshes(target: str) -> Write:
    def then(place: Place) -> None:
        (place.asset / MESHES).rename(place.asset / "elsewhere")
        (place.asset / MESHES).symlink_to(target)

    return asset({BODY: None} if target == OUTSIDE else {}, then)


def _beside(target: str) -> Write:
    return asset(then=lambda place: (place.asset / "more").symlink_to(target))


def _file(name: str, target: str) -> Write:
    return asset({name: None}, lambda place: (place.asset / name).symlink_to(target))


def _referring(path: Callable[[Place], str]) -> Write:
    return lambda place: described(robot(link("body", path(place)), link("lid", LID), hinge()))(place)


def _outer_entity(secret: str, text: str) -> Write:
    return lambda place: described(DTD.format(secret.format(f"file://{place.outside}/secret.txt")) + text)(place)


def _only(name: str, text: str) -> Write:
    return asset({URDF: None, name: text})


def _xacro(inner: str) -> Write:
    root = "xmlns:xacro='http://ros.org/wiki/xacro' name='box'"
    return _only("box.urdf.xacro", robot(inner, link("body", BODY), link("lid", LID), hinge(), attributes=root))


def _sdf(uri: str) -> str:
    shape = f"<geometry><mesh><uri>{uri}</uri></mesh></geometry>"
    inner = f"<link name='body'><visual name='v'>{shape}</visual><collision name='c'>{shape}</collision></link>"
    return f"<sdf version='1.7'><model name='box'>{inner}</model></sdf>"


def _mjcf(meshes: str, compiler: str = "") -> str:
    body = "<worldbody><body name='body'><geom type='mesh' mesh='m'/></body></worldbody>"
    return f"<mujoco>{compiler}<asset>{meshes}</asset>{body}</mujoco>"


def _only_circles(place: Place) -> None:
    for name in ("a", "b"):
        os.symlink(name, place.data / name)


def _manifest(target: str) -> Write:
    def write(place: Place) -> None:
        asset()(place)
        (place.data / "manifest.csv").symlink_to(target)

    return write


def _circle(place: Place) -> None:
    (place.data / "row_itself_link").symlink_to("row_itself_link")
