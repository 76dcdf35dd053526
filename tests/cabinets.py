"""One small cabinet in every format that can be read: a body, a door on an upright hinge at the left of its lower half,
and a drawer front above it. Every number is known, so whatever it is read from, the same must come of it."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from tests.assets import box_obj, link, robot, shape
from tests.assets import joint as urdf_joint
from tests.usd_stages import at, joint, limits, plate, prim, usda

SIZE = (0.422, 0.5, 0.6)
"""Edges of its box, m."""
RANGES = {"door_hinge": (0.0, 1.5), "drawer_slide": (0.0, 0.2)}
AXES = {"door_hinge": (0.0, 0.0, -1.0), "drawer_slide": (1.0, 0.0, 0.0)}
CENTERS = {"body": (0.0, 0.0, 0.3), "door": (0.212, 0.0, 0.15), "drawer": (0.212, 0.0, 0.45)}
Files = Mapping[str, str]

URDF = robot(
    link("body", shape("0.4 0.5 0.6", xyz="0 0 0.3")),
    link("door", shape("0.02 0.48 0.28", xyz="0 0.24 0")),
    link("drawer", shape("0.02 0.48 0.28")),
    urdf_joint("door_hinge", "revolute", "body", "door", xyz="0.212 -0.24 0.15", axis="0 0 -1", limit="0 1.5"),
    urdf_joint("drawer_slide", "prismatic", "body", "drawer", xyz="0.212 0 0.45", axis="1 0 0", limit="0 0.2"),
)

XACRO = """<?xml version="1.0"?>
<robot name="thing" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="height" default="0.6"/>
  <xacro:property name="height" value="$(arg height)"/>
  <xacro:property name="front" value="${0.4 / 2 + 0.012}"/>
  <xacro:include filename="$(find cabinet_description)/urdf/parts.xacro"/>
  <link name="body">
    <visual><origin xyz="0 0 ${height / 2}"/>
      <geometry><mesh filename="package://cabinet_description/meshes/body.obj"/></geometry></visual>
  </link>
  <xacro:plate name="door" offset="0.24"/>
  <xacro:plate name="drawer"/>
  <joint name="door_hinge" type="revolute">
    <origin xyz="${front} -0.24 ${height / 4}"/><parent link="body"/><child link="door"/>
    <axis xyz="0 0 -1"/><limit lower="0" upper="1.5"/>
  </joint>
  <joint name="drawer_slide" type="prismatic">
    <origin xyz="${front} 0 ${3 * height / 4}"/><parent link="body"/><child link="drawer"/>
    <axis xyz="1 0 0"/><limit lower="0" upper="0.2"/>
  </joint>
</robot>
"""
PARTS = """<?xml version="1.0"?>
<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="plate" params="name offset:=0">
    <link name="${name}">
      <visual><origin xyz="0 ${offset} 0"/>
        <geometry><mesh filename="file://$(find cabinet_description)/meshes/plate.obj"/></geometry></visual>
    </link>
  </xacro:macro>
</robot>
"""
MESHES = {"meshes/body.obj": box_obj((-0.2, -0.25, -0.3), (0.2, 0.25, 0.3)),
          "meshes/plate.obj": box_obj((-0.01, -0.24, -0.14), (0.01, 0.24, 0.14))}  # fmt: skip


def sdf_shape(size: str, pose: str = "0 0 0 0 0 0") -> str:
    """An SDF box as visual and collision."""
    return "".join(
        f'<{tag} name="a"><pose>{pose}</pose><geometry><box><size>{size}</size></box></geometry></{tag}>'
        for tag in ("visual", "collision")
    )


def sdf(version: str = "1.7", door_joint: str = "<pose>0 -0.24 0 0 0 0</pose>", axis: str = "<xyz>0 0 -1</xyz>") -> str:
    """The cabinet in SDF: the door's joint is at its edge, not at its frame; the drawer's frame is turned about z."""
    in_model = ' expressed_in="__model__"' if version >= "1.7" else ""
    limit = "<limit><lower>{}</lower><upper>{}</upper></limit>"
    return f"""<?xml version="1.0"?><sdf version="{version}"><model name="thing">
      <link name="body">{sdf_shape("0.4 0.5 0.6", "0 0 0.3 0 0 0")}</link>
      <link name="door"><pose>0.212 0 0.15 0 0 0</pose>{sdf_shape("0.02 0.48 0.28")}</link>
      <link name="drawer"><pose>0.212 0 0.45 0 0 1.5707963267948966</pose>{sdf_shape("0.48 0.02 0.28")}</link>
      <joint name="door_hinge" type="revolute">{door_joint}<parent>body</parent><child>door</child>
        <axis>{axis}{limit.format(0, 1.5)}</axis></joint>
      <joint name="drawer_slide" type="prismatic"><parent>body</parent><child>drawer</child>
        <axis><xyz{in_model}>1 0 0</xyz>{limit.format(0, 0.2)}</axis></joint>
    </model></sdf>"""


MJCF = """<mujoco model="thing">
  <compiler angle="degree" meshdir="meshes"/>
  <default><default class="plate"><geom type="mesh" mesh="plate"/></default></default>
  <asset><mesh name="plate" file="plate_mm.stl" scale="0.001 0.001 0.001"/></asset>
  <worldbody>
    <geom type="plane" size="2 2 0.1"/>
    <body name="body" pos="1 2 0">
      <freejoint/>
      <geom type="box" size="0.2 0.25 0.3" pos="0 0 0.3"/>
      <body name="door" pos="0.212 0 0.15">
        <joint name="door_hinge" axis="0 0 -1" pos="0 -0.24 0" range="0 85.94366926962348"/>
        <geom class="plate"/>
      </body>
      <body name="drawer" pos="0.212 0 0.45">
        <joint name="drawer_slide" type="slide" axis="1 0 0" range="0 0.2"/>
        <geom class="plate"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def dae(size: Sequence[float], unit: float = 1.0, up: str = "Z_UP", nodes: Sequence[str] = ("",)) -> str:
    """A COLLADA file of a box about the origin with these edges in the file's unit, once for each node; a node is what
    stands before its geometry: a translation, a scale, further nodes."""
    x, y, z = (edge / 2.0 for edge in size)
    corners = [(i, j, k) for i in (-x, x) for j in (-y, y) for k in (-z, z)]
    faces = "0 1 3 0 3 2 4 6 7 4 7 5 0 4 5 0 5 1 2 3 7 2 7 6 0 2 6 0 6 4 1 5 7 1 7 3"
    numbers = " ".join(str(value) for corner in corners for value in corner)
    params = "".join(f'<param name="{name}" type="float"/>' for name in "XYZ")
    shown = "".join(
        f'<node id="n{i}">{node}<instance_geometry url="#g"/></node>' if "<node" not in node else node
        for i, node in enumerate(nodes)
    )
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="unit" meter="{unit}"/><up_axis>{up}</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="24">{numbers}</float_array>
<technique_common><accessor source="#a" count="8" stride="3">{params}</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/><p>{faces}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s">{shown}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def usd_part(name: str, size: Sequence[float], place: Sequence[float], middle: Sequence[float] = (0, 0, 0)) -> str:
    """A rigid body of a box, without a mass."""
    return prim("Xform", name, at(place), plate("mesh", size, place=at(middle)), apis=("PhysicsRigidBodyAPI",))


USD = usda(
    prim("Xform", "thing",
         usd_part("body", (50, 60, 40), (0, 0, 0), (0, 30, 0)), usd_part("door", (48, 28, 2), (0, 15, 21.2)),
         usd_part("drawer", (48, 28, 2), (0, 45, 21.2)),
         joint("Revolute", "door_hinge", ("/thing/body", "/thing/door"), limits(0.0, 85.94366926962348, "Y"),
               frame0="-24 15 21.2|0 1 0 0", frame1="-24 0 0|0 1 0 0"),
         joint("Prismatic", "drawer_slide", ("/thing/body", "/thing/drawer"), limits(0.0, 20.0, "Z"),
               frame0="0 45 21.2")),
    up="Y", metres=0.01, default="thing",
)  # fmt: skip
"""In centimetres, y up, its front towards z; the hinge's frame is turned round."""

COLLADA = URDF.replace('<box size="0.4 0.5 0.6"/>', '<mesh filename="body.dae"/>').replace(
    '<box size="0.02 0.48 0.28"/>', '<mesh filename="plate.dae"/>'
)
HALVES = ("<translate>0 0 -15</translate>", '<node><scale>2 2 2</scale><translate>0 0 7.5</translate>'
          '<node><scale>0.5 0.5 0.5</scale><instance_geometry url="#g"/></node></node>')  # fmt: skip
"""The body's lower and upper half as two instances of one geometry, the upper one below nested transforms."""

FORMATS: dict[str, Files] = {
    "urdf": {"thing.urdf": URDF},
    "xacro": {"urdf/cabinet.urdf.xacro": XACRO, "urdf/parts.xacro": PARTS, **MESHES},
    "sdf": {"model.sdf": sdf(), "model.config": "<model/>"},
    "sdf_1_4": {"model.sdf": sdf("1.4")},
    "mjcf": {"thing.xml": MJCF},
    "usd": {"thing.usda": USD},
    "collada": {
        "thing.urdf": COLLADA,
        "body.dae": dae((40, 50, 30), 0.01, "Y_UP", HALVES),
        "plate.dae": dae((20, 480, 280), 0.001, "Z_UP"),
    },
}
"""What it is read from → the asset folder's files."""


def written_cabinet(folder: Path, kind: str) -> Path:
    """The asset folder of the cabinet in one of ``FORMATS``."""
    for name, text in FORMATS[kind].items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    if kind == "mjcf":
        import trimesh

        (folder / "meshes").mkdir(exist_ok=True)
        trimesh.creation.box(extents=(20, 480, 280)).export(folder / "meshes" / "plate_mm.stl")
    return folder
