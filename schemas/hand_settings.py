"""Bounds of a hand that uses an object, and the checks of its use (``--check``)."""

from pydantic import Field

from schemas.base import Fraction, Frozen, Positive
from schemas.declared import FurtherCheck

FINGERTIP_M = 0.016
"""Width of a finger tip, m: a hand's finger, and a gripper's."""


class HandSettings(Frozen):
    """A gripper of two fingers that floats, and how it uses parts."""

    force_n: Positive = 45.0
    """Most force, N, where nothing is known to take more: what catches of appliances let go at (``efforts.csv``)."""
    most_n: Positive = 150.0
    """... for what is known to take more, N: the hardest screw caps (``efforts.csv``), as a grown-up hand turns."""
    torque_n_m: Positive = 5.0
    """Most torque about the wrist, N·m: screw caps take up to 4.7 (``efforts.csv``)."""
    grip_n: Positive = 70.0
    """Force of the fingers, N: the Franka Hand's continuous force; under the 78 N that women's thumb and forefinger
    press with on average (key pinch, Mathiowetz 1985)."""
    pad_friction: Positive = 1.0
    """Friction of the finger pads: rubber, or skin, on what is dry (0.8 to 1.2)."""
    opening_m: Positive = 0.085
    """Widest opening, m: a Robotiq 2F-85's, and a hand's pinch."""
    between_m: Positive = 0.6
    """Widest that both hands hold between them, laid flat against it, m: more than a grown-up's shoulders (0.5)."""
    tip_scale: Fraction = 0.4
    """Size of the finger tips for what is too small for the hand, against it: 6 mm, a finger nail's."""
    speed_m_s: Positive = 0.25
    """Speed at which it leads a part, m/s: a drawer in two seconds (``hand_opens_s``)."""
    turn_rad_s: Positive = 1.5
    """... and of a turn, rad/s: a knob by a quarter in a second."""
    way_s: Positive = 2.0
    """Time in which even the longest way is gone, s: as ``hand_opens_s``."""
    lead_m: Positive = 0.015
    """How far it is led ahead of the part, m: what its springs give at its most force, and a little."""
    turned_rad: Positive = 1.5707963
    """How far what has no limits is turned, rad."""
    tries: int = Field(3, ge=1)
    """Holds that are tried for one way, each from where the one before left the part."""
    stalled_s: Positive = 0.4
    """Time without progress after which a hold is given up, s: a servo's settling is a tenth of it."""
    opened_share: Fraction = 0.9
    """Share of its range to which a part is opened: no hand gets behind a flap that lies flat against a wall."""
    open_share: Fraction = 0.8
    """Share of that way by which it must be open: beyond it, nothing more is to be had of a drawer or door."""
    closed_share: Fraction = 0.1
    """... and what may be left of it once it is shut: a gasket's or a magnet's way."""
    most_joints: int = Field(8, ge=1)
    """Joints of one object that are used, spread over all alike: a keyboard's keys are as good as eight of them."""
    timestep_s: Positive = 2e-3
    """Time step, s: half the time constant of its contacts, as in the environment."""
    steadied_kg: Positive = 3.0
    """Mass up to which the other hand holds an object that moves along, kg: an arm's payload (Franka Research 3)."""

    @property
    def pressed_n(self) -> float:
        """Most that a finger, palm or flat hand may press on an object, N: the grip, and the hand's force on top."""
        return self.grip_n + self.most_n


class ContentSettings(Frozen):
    """Bodies that lie in drawers and boxes and on shelves, and when they stay. What opens them is the hand's."""

    least_m: Positive = 0.02
    """Smallest body, m: a marble, a screw; a space into which three do not fit is no interior."""
    least_share: Fraction = 0.05
    """... over the longest edge of the object, of which it is no more: 1 cm of a box of 20 cm."""
    most_m: Positive = 0.06
    """Largest body, m: a tennis ball, a mug's width."""
    room_share: Fraction = 0.6
    """Radius of a body over the greatest distance to a face in the interior: room for a hand to set it down."""
    finger_m: Positive = FINGERTIP_M
    """Room beside a body for the finger that sets it down, m, where there is so much: the hand's are as wide."""
    density_kg_m3: Positive = 700.0
    """Density of the bodies, kg/m³: wood, fruit; 80 g for the largest ball."""
    friction: Positive = 0.5
    """Friction of the bodies: wood or plastic on wood or plastic."""
    rolling_m: Positive = 5e-4
    """Rolling friction, m: hard wood on hard wood; the largest ball stays where the floor leans by less than 1°."""
    gap_m: Positive = 3e-4
    """Height over the floor at which a body is set down, m."""
    deep_share: Fraction = 0.1
    """How deep a body may begin in a collision shape, over its radius: MuJoCo pushes it out of that without a jump."""
    free_share: Fraction = 0.5
    """Least share of the room that the mesh leaves which must be free of collision shapes."""
    wait_s: Positive = 0.3
    """Time for which bodies rest before, and after each way, s: to fall by 40 cm."""
    least_way_s: Positive = 0.3
    """Least time of a way, s: a flick."""
    most_interiors: int = Field(4, ge=1)
    """Interiors of one object that are tried, spread over all: drawers of one chest are alike."""


class LiftSettings(Frozen):
    """Bounds of what hands carry, and of carrying it well."""

    carried_m: Positive = 0.5
    """Longest edge of what one hand carries, m, unless it is a thing of the hand: a bucket, a bag, a laptop; and it
    weighs no more than ``steadied_kg``. Both hands carry twice as long and as heavy."""
    high_m: Positive = 0.1
    """How high it is lifted, m: over what stands beside it on a table."""
    risen_share: Fraction = 0.8
    """Share of that by which it must rise: the hand's springs give 8 mm under 3 kg."""
    speed_m_s: Positive = 0.15
    """Speed of the lift, m/s: with care, for what is not to spill."""
    yaws: int = Field(4, ge=1)
    """Ways in which it is turned; the first that fails ends it, since a hand that floats comes from anywhere."""
    grasps: int = Field(3, ge=1)
    """Grasps that are tried at each."""
    tilt_rad: Positive = 0.79
    """Most turn in the hand, rad: what hangs from an edge; beyond 45° it hangs or spills."""


SOURCES = (
    "asset2sim.gym.hand",
    "asset2sim.assets.meshes.interior",
    "asset2sim.gym.contacts",
    "asset2sim.gym.world",
    "asset2sim.load",
    "schemas.hand_settings",
)
HAND_CHECKS = (
    FurtherCheck(
        "used", "a hand opens and closes every part in MuJoCo", "tasks.by_hand:measure_used",
        "schemas.tables:USED", SOURCES,
    ),
    FurtherCheck(
        "contents", "what lies in drawers and boxes stays there as a hand opens and closes them, in MuJoCo",
        "tasks.by_hand:measure_contents", "schemas.tables:CONTENTS", SOURCES,
    ),
    FurtherCheck(
        "lifted", "a hand lifts what it carries and sets it down, its joints as they were, in MuJoCo",
        "tasks.by_hand:measure_lifted", "schemas.tables:LIFTED", SOURCES,
    ),
)  # fmt: skip
