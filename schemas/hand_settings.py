"""Settings of what hands, grippers and policies do with a refined object: its use by hand, its contents, learning."""

from typing import Literal

from pydantic import Field

from schemas.base import Fraction, Frozen, NonNegative, Positive
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
    """Bounds of what one hand carries, and of carrying it well."""

    carried_m: Positive = 0.5
    """Longest edge of what one hand carries, m, unless it is a thing of the hand: a bucket, a bag, a laptop; and it
    weighs no more than ``steadied_kg``."""
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
    "asset2sim.gym.arm.scene",
    "asset2sim.load",
    "schemas.hand_settings",
)
HAND_CHECKS = (
    FurtherCheck(
        "used", "a hand opens and closes every part in MuJoCo", "tasks.by_hand:measure_used",
        "schemas.tables_engines:USED", SOURCES,
    ),
    FurtherCheck(
        "contents", "what lies in drawers and boxes stays there as a hand opens and closes them, in MuJoCo",
        "tasks.by_hand:measure_contents", "schemas.tables_engines:CONTENTS", SOURCES,
    ),
    FurtherCheck(
        "lifted", "a hand lifts what it carries and sets it down, its joints as they were, in MuJoCo",
        "tasks.by_hand:measure_lifted", "schemas.tables_engines:LIFTED", SOURCES,
    ),
)  # fmt: skip


class RewardSettings(Frozen):
    """Weights and lengths of the paper's reward. The paper publishes none of them: these are ours, the same for every
    object, chosen so that being near never pays more than moving the part, and a penalty never more than being near."""

    reach_weight: Positive = 1.0
    """ω1, of being near the part: the unit of the others."""
    reach_m: Positive = 0.2
    """σ1, m: an arm that waits 0.3 m away is still on the slope (tanh 1.5 = 0.91)."""
    reach_xy_weight: Positive = 0.5
    """ω2, of being over or beside it: half, since the distance has it already."""
    reach_xy_m: Positive = 0.2
    """σ2, m: as σ1."""
    joint_weight: Positive = 10.0
    """ω3, of the joint: a part at its target pays seven times what being near can (ω1 + ω2)."""
    joint_decay: Positive = 3.0
    """α: a joint a whole range away pays 5 % of ω3 (0.5, less than reaching it), one at a tenth of it 74 %."""
    gate_m: Positive = 0.05
    """δ, m, of the point between the finger tips from the part: finger tips that touch are 0.01 to 0.03 m away, as the
    hand leans; parts that drift while the arm is further away earn nothing."""
    opening_weight: Positive = 0.1
    """λ1, of a gripper that stands open: a tenth of being near, so it decides between equals alone."""
    tilt_weight: Positive = 0.1
    """λ2, of a hand that does not point down: at most 0.2, against it."""
    off_xy_weight: Positive = 0.1
    """λ3, per metre of planar distance: less than the slope of ω2, which it supports where tanh is flat."""
    least_way: Positive = 0.02
    """ε of S, share of the range: a way shorter than that is within what perturbed starts and a joint's play move."""


class GuardSettings(Frozen):
    """From when a rollout counts as degenerate: the part got to its target otherwise than by the arm."""

    success: Fraction = 0.9
    """S from which a task is done."""
    pressed: Fraction = 0.8
    """The same where something is pressed, at its deepest: springs and rubber give (as in recorded interactions)."""
    solved_share: Fraction = 0.02
    """A start within this share of the range of the target is solved, as ε of S: the stapler of the paper has 4 %."""
    untouched_share: Fraction = 0.5
    """Share of the way to the target that the part may go untouched: one that is flicked coasts, but more than half of
    the way without the hand is not the hand's doing. A lid that falls shut once it was touched is left out; one that
    was struck and coasts shut is not."""
    steady_share: Fraction = 0.99
    """Share of its speed 4 ms before from which a part that goes down falls: one that slows down coasts from a blow."""
    away_samples: int = Field(10, ge=1)
    """Samples of 4 ms between two touches up to which a part that slows down is still pushed along: planned pushes of
    light lids hop by a third of the way in longer ones, sweeps that strike them by two thirds."""
    drift_share: Fraction = 0.05
    """Share of its way by which the part may move towards the target before it is first touched: 5 mm of 10 cm."""
    spring_share: Fraction = 0.5
    """Share of the work of spring and arm that the part's spring may do."""
    tilt_rad: Positive = 0.26
    """Tilt of the object beyond which it was tipped and not used, rad: 15°, what a rocking table comes back from."""
    lift_m: Positive = 0.03
    """Rise of its root link from which the object was lifted, m: as in recorded interactions."""
    travel_m: Positive = 0.05
    """Way of its root link along the floor from which the object was shoved, m: half a hand's width. One of 120 random
    sweeps past a box gets by with it, four with 0.1 m."""
    least_work_j: Positive = 1e-3
    """Work of a spring below which it is none, J: a part of 20 g lifted by 5 mm."""


class LearningSettings(Frozen):
    """Everything that decides what an episode is."""

    gripper: Literal["panda", "robotiq"] = "panda"
    """The arm's own, or the paper's Robotiq 2F-85, whose model robosuite's package has."""
    reward: RewardSettings = RewardSettings()
    guards: GuardSettings = GuardSettings()
    ends_displaced: bool = True
    """Whether an episode is over, and lost, once the object itself is tipped, lifted or shoved beyond the guards'
    bounds: the paper's reward reads the joint alone, and policies tip the object. False is as the paper."""
    timestep_s: Positive = Field(2e-3, le=4e-3)
    """Time step, s, a divisor of 4 ms: twice that of recorded interactions and half the time constant of contacts, the
    longest that MuJoCo keeps stable. The planned pushes of the paper's nine come out as with 1 ms, at half the cost."""
    samples_per_action: int = Field(20, ge=1)
    """Samples of 4 ms that an action lasts: 80 ms, 12.5 actions a second (DROID's policies act 15 times). The arm's
    servos settle in 0.1 s, so faster actions are hardly felt, and their noise averages out before a part moves."""
    episode_s: Positive = 10.0
    """Length of an episode, s: a planned push of the paper's objects takes 5 to 9 s with the way there."""
    tool_step_m: Positive = 0.024
    """Largest shift of the tool in one action, m, along each axis: 0.3 m/s, as the scripted arm moves."""
    turn_step_rad: Positive = 0.1
    """Largest turn of the tool about each axis, or of a joint, in one action, rad: 1.25 rad/s, as the scripted arm."""
    finger_step_m: Positive = 0.008
    """Largest motion of a finger in one action, m: 0.1 m/s."""
    lead_rad: Positive = 0.25
    """How far a joint's command may be ahead of it, rad: what the servo lags at full speed (0.15 rad), and some force
    left to push with; beyond it a blocked arm would store up commands."""
    perturbed: bool = True
    """Whether a reset draws one of the starts of the reset check (``checks/reset.py``) or always the plain one."""
    arm_noise_rad: NonNegative = 0.02
    """How far each joint of the arm may be off its waiting position at the start of an episode that draws its start,
    rad, evenly distributed: the size that robosuite gives its arms. Without it two rollouts of a policy from the same
    of the nine starts are the same rollout."""
    settle_s: Positive = 1.0
    """Time that a free object is given to come to rest after a perturbed start, s: a drop of 2 cm takes 0.06 s. Its
    joints are held meanwhile: in the drop a lid that friction holds would slip, and the task begin solved."""
