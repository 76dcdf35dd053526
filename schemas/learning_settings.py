"""Settings of the environment in which a robot learns to use an object, its reward, its clock and its guards."""

from typing import Literal

from pydantic import Field

from schemas.base import Fraction, Frozen, NonNegative, Positive


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
    was struck and coasts shut, or whose friction bears it, is not."""
    steady_share: Fraction = 0.99
    """Share of its speed 4 ms before from which a part that goes down falls: one that slows down coasts from a blow."""
    away_samples: int = Field(10, ge=1)
    """Samples of 4 ms between two touches up to which a part that slows down is still pushed along: planned pushes of
    light lids hop by a third of the way in longer ones, sweeps that strike them by two thirds."""
    drift_share: Fraction = 0.05
    """Share of its way by which the part may move towards the target before it is first touched: 5 mm of 10 cm."""
    spring_share: Fraction = 0.5
    """Share of the work of spring and arm that the part's spring may do."""
    struck_m_s: Positive = 0.6
    """Speed of the part's edge from which it is struck, m/s: twice that of the arm's tool, a quarter more than a hand's
    fastest, 15/8 of its mean 0.25 m/s in a motion with least jerk (Flash and Hogan 1985). Planned pushes of the paper's
    nine reach 0.36."""
    struck_share: Fraction = 0.5
    """Share of the way to the target that the part may go faster than that, what falls aside."""
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
