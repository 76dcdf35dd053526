"""The defects of the bench: each a class seen in real assets, planted in one place of one clean object."""

from lab.defects import plants_joints as joints
from lab.defects import plants_links as links
from lab.defects import remaining as left
from lab.defects.planting import Defect, Target, changed

BESIDE_M, FAR_M = 0.6, 3.0
"""Distances of planted centres of mass from the clean ones, m: beyond any sample's feet, and far from the object."""
LID = Target("box_wooden", "link_0", "joint_0")
BOX = Target("box_wooden", "link_1")
SCREEN = Target("laptop_silver", "link_0", "joint_0")
DRAWER = Target("table_two_drawers", "link_0", "joint_0")
CABINET = Target("table_two_drawers", "link_2")
DOOR = Target("storage_sideboard", "link_0", "joint_0")
TRAY = Target("storage_sideboard", "link_1", "joint_1")

DEFECTS: tuple[Defect, ...] = (
    Defect("mass x 1000", TRAY, links.mass_times(1e3), left.mass_left),
    Defect("mass / 10000", SCREEN, links.mass_times(1e-4), left.mass_left),
    Defect("mass of zero", LID, links.mass_times(0.0), left.mass_left),
    Defect("mass not a number", DRAWER, changed("link", "inertial/mass", links.mass_not_a_number), left.mass_left),
    Defect("inertial missing", DOOR, changed("link", "inertial", links.inertial_missing), left.mass_left),
    Defect("inertia of a point", SCREEN, links.inertia_of_a_point, left.mass_left),
    Defect("inertia impossible", DOOR, changed("link", "inertial/inertia", links.inertia_impossible), left.mass_left),
    Defect("inertia negative", LID, links.inertia_negative, left.mass_left),
    Defect("inertia x 1e6", DRAWER, links.inertia_times(1e6), left.mass_left),
    Defect("inertia x 1e-9", LID, links.inertia_times(1e-9), left.mass_left),
    Defect("centre of mass outside", LID, links.centre_moved_by(0.0, FAR_M), left.centre_left),
    Defect("centre of mass beyond its feet", BOX, links.centre_moved_by(BESIDE_M, 0.0), left.centre_left),
    Defect("damping over the bound", SCREEN, joints.damping_unstable, left.damping_left),
    Defect("damping negative", LID, joints.damping_negative, left.damping_left),
    Defect("spring without damping", LID, joints.spring_undamped, left.spring_left),
    Defect("stiffness over the bound", DRAWER, joints.stiffness_unstable, left.spring_left),
    Defect("spring that opens a lid", SCREEN, joints.spring_opens, left.spring_left),
    Defect("friction beyond a hand", LID, joints.friction_times(8.0), left.hand_left),
    Defect("friction that sticks", DOOR, joints.friction_sticks, left.friction_left),
    Defect("friction negative", SCREEN, joints.friction_negative, left.friction_left),
    Defect("effort limit of zero", SCREEN, joints.limit(joints.effort_zero), left.effort_left),
    Defect("axis inverted, hinge", DOOR, joints.axis_times(-1.0), left.axis_left),
    Defect("axis inverted, slider", DRAWER, joints.axis_times(-1.0), left.axis_left),
    Defect("axis not of unit length", DRAWER, joints.axis_times(3.0), left.axis_left),
    Defect("axis of zero", LID, joints.axis_times(0.0), left.axis_left),
    Defect("limits crossed", SCREEN, joints.limit(joints.limits_crossed), left.limits_left),
    Defect("limits in degrees", LID, joints.limit(joints.limits_in_degrees), left.limits_left),
    Defect("limits missing", DOOR, joints.limit(joints.limits_missing), left.passage_left),
    Defect("zero outside the limits", DRAWER, joints.limit(joints.zero_outside_limits), left.start_left),
    Defect("hinge in the wrong place", DOOR, joints.pivot_moved_by(0.25, 0.0, 0.0), left.pivot_left),
    Defect("link shifted into its neighbour", DRAWER, joints.shifted_by(0.0, -0.05, 0.0), left.overlap_left),
    Defect("link shifted into its parent", DOOR, joints.shifted_by(0.0, 0.0, -0.035), left.overlap_left),
    Defect("collision mesh flat", SCREEN, links.flat_collision, left.shape_left),
    Defect("collision mesh in millimetres", DOOR, links.collision_in_millimetres, left.shape_left),
    Defect("collision mesh elsewhere", LID, links.collision_elsewhere, left.shape_left),
    Defect("collision mesh missing", SCREEN, links.collision_missing, left.shape_left),
    Defect("collision mesh not a number", DRAWER, links.collision_not_a_number, left.shape_left),
    Defect("collision mesh inside out", LID, links.collision_inside_out, left.shape_left),
    Defect("collision mesh with holes", DOOR, links.collision_with_holes, left.shape_left),
    Defect("inside filled by one hull", CABINET, links.inside_filled, left.shape_left),
    Defect("everything in millimetres", SCREEN, links.all_in_millimetres, left.size_left),
    Defect("two links of one name", LID, changed("link", ".", joints.duplicate_link), left.never_mended),
    Defect("link with two parents", DRAWER, changed("joint", ".", joints.two_parents), left.never_mended),
    Defect("joint without a name", SCREEN, changed("joint", ".", joints.unnamed_joint), left.never_mended),
)
