"""XML, trees and folders of a shape that no exporter writes on purpose."""

from collections.abc import Sequence

from schemas.vocabulary import FailureMode
from tests.hostile.case import HANDLED, REFUSED, RULES, Case
from tests.hostile.tiny import BODY, LID, MESHES, URDF, Write, asset, described, hinge, link, robot

XACRO = "xmlns:xacro='http://ros.org/wiki/xacro' name='box'"
LAUGHS = "".join(f"<!ENTITY l{n} '{f'&l{n - 1};' * 10}'>" for n in range(1, 12))
BODY_LINK, LID_LINK = link("body", BODY), link("lid", LID)


def cases() -> Sequence[Case]:
    """URDFs by their texts, folders by their files."""
    refused = [Case(name, described(text), REFUSED) for name, text in _refused().items()]
    many = robot(BODY_LINK, *(link(f"l{n}", LID) + hinge(f"j{n}", child=f"l{n}") for n in range(130)))
    refused.append(Case("links_131", described(many), frozenset({FailureMode.ENGINE_REFUSED}), "131 links"))
    # As it came, PyBullet refuses a hinge without limits.
    words = {"no_limit": RULES}
    handled = [Case(name, described(text), HANDLED, words=words.get(name, ())) for name, text in _handled().items()]
    # What a xacro computes may take as long as it likes: its asset ends with its time.
    modes = {"xacro_power": HANDLED | {FailureMode.TIMEOUT}}
    # A folder of assets may be meant: the inner one is the asset then.
    ids = {"urdf_in_urdf_folder": "box.urdf", "two_urdfs": "two_urdfs_a", "xacro_two": "xacro_two_a"}
    folders = [Case(key, write, modes.get(key, HANDLED), "", ids.get(key, "")) for key, write in _folders().items()]
    return [*refused, *handled, *folders]


def _refused() -> dict[str, str]:
    """URDFs that cannot be read, or are no tree."""
    return {
        "empty_robot": "<robot name='x'/>",
        "no_geometry": robot("<link name='body'/>"),
        "other_root": "<sdf><model/></sdf>",
        "laughs": f"<!DOCTYPE robot [<!ENTITY l0 'ha'>{LAUGHS}]>" + robot(link("&l11;", BODY)),
        "circle": robot(BODY_LINK, LID_LINK, hinge(), hinge("j2", "lid", "body")),
        "two_roots": robot(BODY_LINK, LID_LINK),
        "two_parents": robot(BODY_LINK, LID_LINK, link("third", LID), hinge(), hinge("j2", "third")),
        "joint_to_itself": robot(BODY_LINK, hinge(child="body")),
        "unknown_child": robot(BODY_LINK, hinge(child="gone")),
        "unknown_parent": robot(LID_LINK, hinge(parent="gone")),
        "link_twice": robot(BODY_LINK, BODY_LINK, LID_LINK, hinge()),
        "joint_twice": robot(BODY_LINK, LID_LINK, link("third", LID), hinge(), hinge(child="third")),
        "link_unnamed": robot(BODY_LINK.replace('name="body"', ""), LID_LINK),
        "joint_unnamed": robot(BODY_LINK, LID_LINK, hinge().replace('name="joint_0" ', "")),
        "joint_untyped": robot(BODY_LINK, LID_LINK, hinge().replace('type="revolute"', "")),
        "joint_no_child": robot(BODY_LINK, LID_LINK, hinge().replace('<child link="lid"/>', "")),
        "joint_no_parent": robot(BODY_LINK, LID_LINK, hinge().replace('<parent link="body"/>', "")),
        "joint_unknown_type": robot(BODY_LINK, LID_LINK, hinge(kind="hinge")),
        "joint_planar": robot(BODY_LINK, LID_LINK, hinge(kind="planar")),
        "joint_empty": robot(BODY_LINK, LID_LINK, "<joint/>"),
        "attribute_twice": robot(BODY_LINK.replace('name="body"', 'name="body" name="b"'), LID_LINK, hinge()),
        "unclosed": robot().replace("</link>", "", 1),
        "crossed": "<robot name='x'><link name='body'></robot></link>",
        "bare_ampersand": robot(link("a&b", BODY)),
        "axis_zero": robot(BODY_LINK, LID_LINK, hinge().replace("1 0 0", "0 0 0")),
        "meshes_all_missing": robot(link("body", "gone.obj"), link("lid", "gone.obj"), hinge()),
        "mesh_no_name": robot(link("body").replace(' filename=""', ""), link("lid"), hinge()),
    }


def _handled() -> dict[str, str]:
    """URDFs that may be read, in part or whole."""
    chain = [link(f"l{n}", LID if n else BODY) for n in range(60)]
    chain += [hinge(f"j{n}", f"l{n}", f"l{n + 1}") for n in range(59)]
    names = {"blank": " ", "dot": ".", "up": "..", "root": "/", "folder": MESHES, "data": "data:,x", "long": "x" * 5000}
    mimics = {"itself": "joint_0", "nobody": "gone", "empty": ""}
    limit = '<limit lower="0" upper="1" effort="1" velocity="1"/>'
    return {
        "deep": robot(f"{'<a>' * 5000}{'</a>' * 5000}", BODY_LINK, LID_LINK, hinge()),
        "nested_robots": robot(robot(), BODY_LINK, LID_LINK, hinge()),
        "namespace": robot(attributes='xmlns="http://example.org/urdf" name="box"'),
        "prefix": robot(attributes='xmlns:x="http://example.org/x" x:version="1" name="box"'),
        "capitals": robot().replace("<link", "<Link").replace("</link", "</Link"),
        "unnamed": robot(attributes=""),
        "instructions": "<?go fast?>" + robot("<!-- x -->", "<?stop?>", BODY_LINK, LID_LINK, hinge()),
        "section": robot("<![CDATA[<link/>]]>", BODY_LINK, LID_LINK, hinge()),
        "unknown_tags": robot("<gazebo/><transmission><x/></transmission>", BODY_LINK, LID_LINK, hinge()),
        "chain": robot(*chain),
        "one_link": robot(BODY_LINK),
        "floating": robot(BODY_LINK, LID_LINK, hinge(kind="floating")),
        "no_limit": robot(BODY_LINK, LID_LINK, hinge(inner="<dynamics/>")),
        "two_limits": robot(BODY_LINK, LID_LINK, hinge(inner=limit * 2)),
        "two_origins": robot(BODY_LINK, LID_LINK, hinge().replace("<axis", '<origin xyz="1 1 1"/><axis')),
        "no_axis": robot(BODY_LINK, LID_LINK, hinge().replace('<axis xyz="1 0 0"/>', "")),
        "shape_unknown": robot(BODY_LINK.replace("mesh filename", "torus filename"), LID_LINK, hinge()),
        "shapes_two": robot(BODY_LINK.replace("<geometry>", '<geometry><box size="1 1 1"/>'), LID_LINK, hinge()),
        "geometry_empty": robot(BODY_LINK, link("lid", LID).replace(f'<mesh filename="{LID}"/>', ""), hinge()),
        "inertial_empty": robot(link("body", BODY, "<inertial/>"), LID_LINK, hinge()),
        "many_visuals": robot(BODY_LINK.replace("</link>", "<visual/>" * 500 + "</link>"), LID_LINK, hinge()),
        **{f"mesh_{key}": robot(link("body", name), LID_LINK, hinge()) for key, name in names.items()},
        **{
            f"mimic_{k}": robot(BODY_LINK, LID_LINK, hinge(inner=f'<mimic joint="{n}"/>{limit}'))
            for k, n in mimics.items()
        },
    }


def _folders() -> dict[str, Write]:
    """Assets by their files."""
    loop = "<xacro:include filename='box.urdf.xacro'/>"
    macro = "<xacro:macro name='m'><xacro:m/></xacro:macro><xacro:m/>"
    forever = "<xacro:macro name='m' params='n'><xacro:m n='${n + 1}'/></xacro:macro><xacro:m n='0'/>"
    return {
        "nothing_but_meshes": asset({URDF: None, "box.sdf": ""}),
        "two_urdfs": asset({URDF: None, "a.urdf": robot(), "b.urdf": robot()}),
        "urdf_in_urdf_folder": asset({URDF: None, "box.urdf/box.urdf": robot()}),
        "xacro_loop": _xacro(loop),
        "xacro_macro": _xacro(macro),
        "xacro_forever": _xacro(forever),
        "xacro_power": _xacro("<xacro:property name='x' value='${9**9**9}'/><link name='${x}'/>"),
        "xacro_import": _xacro("<link name=\"${__import__('os').getcwd()}\"/>"),
        "xacro_broken": _xacro("<link name='${'/>"),
        "xacro_argument": _xacro("<link name='$(arg gone)'/>"),
        "xacro_two": asset({URDF: None, "a.xacro": robot(attributes=XACRO), "b.xacro": robot(attributes=XACRO)}),
        "sdf_empty": asset({URDF: None, "model.sdf": "<sdf version='1.7'/>"}),
        "sdf_two_models": asset(
            {URDF: None, "model.sdf": "<sdf version='1.7'><model name='a'/><model name='b'/></sdf>"}
        ),
        "sdf_not_xml": asset({URDF: None, "model.sdf": "model"}),
        "sdf_include": asset(
            {URDF: None, "model.sdf": "<sdf version='1.7'><include><uri>model.sdf</uri></include></sdf>"}
        ),
        "mjcf_empty": asset({URDF: None, "model.xml": "<mujoco/>"}),
        "mjcf_cut": asset({URDF: None, "model.xml": "<mujoco><worldbody>"}),
        "mjcf_loop": asset({URDF: None, "model.xml": "<mujoco><include file='model.xml'/></mujoco>"}),
        "mjcf_unknown": asset({URDF: None, "model.xml": "<mujoco><worldbody><cow/></worldbody></mujoco>"}),
        "many_files": asset({f"more/{number:04}": "" for number in range(2000)}),
        "deep_folders": asset({f"{'d/' * 300}x": ""}),
    }


def _xacro(inner: str) -> Write:
    return asset({URDF: None, "box.urdf.xacro": robot(inner, BODY_LINK, LID_LINK, hinge(), attributes=XACRO)})
