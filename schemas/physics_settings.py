"""Bounds and defaults of masses and joints, which keep what is written simulable in every engine."""

from schemas.base import Fraction, Frozen, NonNegative, Positive
from schemas.vocabulary import DynamicsRule


class PhysicsSettings(Frozen):
    """Bounds that keep what is written simulable in every engine."""

    dynamics: DynamicsRule = DynamicsRule.INERTIA
    """Where joint damping, friction and stiffness come from."""
    min_mass_kg: Positive = 1e-3
    """The lightest link, kg: the paper's tiny parts weigh 1 to 10 g; below 1 g contact solvers lose precision."""
    smallest_mass_kg: Positive = 1e-4
    """The lightest that a tiny link may stay where ``min_mass_kg`` would make it denser than any material, kg;
    lighter only where even this would, by ``max_density_kg_m3``."""
    least_pressed_kg: Positive = 2e-4
    """The lightest part that is pressed against its spring, kg: behind a button stand a plunger and a dome (6 mm
    tactile switches weigh 0.25 to 0.35 g in all)."""
    max_density_kg_m3: Positive = 20_000.0
    """Densest a link may be, over its hull, kg/m³: gold and tungsten have 19,300."""
    raised_density_kg_m3: Positive = 1_000.0
    """Densest that a tiny link is made so that solvers take it, over its hull, kg/m³: a button of solid plastic. Beyond
    it the solver is helped by armature, not by weight."""
    max_spring_hz: Positive = 1000.0
    """Largest spring frequency that is accepted before the time step bounds it, Hz."""
    max_mass_ratio: Positive = 1000.0
    """Heaviest over lightest link that others hang from: beyond about 1000 iterative solvers stop converging. A part at
    the end of the tree keeps its own mass."""
    massless_share: Fraction = 0.1
    """Share of its neighbour's mass that a link without geometry takes over, so that no engine invents 1 kg for it."""
    min_inertia_kg_m2: Positive = 1e-9
    """Smallest principal moment: engines round smaller ones to zero, and a zero inertia freezes the link."""
    min_half_extent_m: Positive = 1e-3
    """Half thickness that a flat link is given for its inertia, m: a sheet has no volume and a singular inertia."""
    max_damping_step: Fraction = 0.5
    """Largest damping · Δt / I_eff at the coarse step: explicit damping reverses the motion from 1 on and
    explodes from 2 on."""
    max_stiffness_step: Fraction = 0.25
    """Largest stiffness · Δt² / I_eff at the coarse step: an explicit spring is unstable from 4 on."""
    max_press_step: Fraction = 0.5
    """Largest share of its travel that a spring may move its part from rest in one coarse step: beyond, a limit cannot
    hold what the spring presses on it. Armature grows until it holds."""
    plain_timestep_s: Positive = 1.0 / 240.0
    """Time step at which a URDF is loaded without armature, which no URDF holds, s: PyBullet's own."""
    plain_press_step: Fraction = 0.25
    """Largest share of its travel that a spring in a URDF may move its part in one such step."""
    max_friction_step: Positive = 1000.0
    """Largest deceleration by a joint's dry friction, rad/s² or m/s²: beyond, solvers whose friction yields a little
    let a light part creep under half of it. Armature grows until it holds."""
    max_friction_creep: Positive = 40_000.0
    """The same over the travel of its part, 1/s²: in MuJoCo at 240 Hz dry friction yields by 0.6 µs of the deceleration
    each second, so that a part that a hand loads to its friction creeps by 2.5 % of its way a second."""
    max_armature_ratio: Positive = 10_000.0
    """Largest armature of a joint over the inertia of its part: beyond, single precision shakes what the spring holds.
    A button of 0.1 g that moves by half a millimetre gets 1 kg, and so a spring of 1 N, at the coarse step."""
    press_margin: Fraction = 0.5
    """Largest press on a part, as a share of the force that tips or slides the whole object."""
    held_by_hand_kg: Positive = 1.0
    """Mass below which one hand holds the object while the other presses a part sideways or from below, kg: a remote
    control or a camera."""
    coarse_timestep_s: Positive = 1.0 / 60.0
    """The coarsest time step that users run, s (robot learning at 60 Hz)."""
    least_reach_m: Positive = 1e-4
    """Least reach of a part from its centre of mass that is assumed, m: a tenth of a millimetre."""
    max_inertia_ratio: Positive = 1e5
    """Largest principal moment of a link over the smallest of one that moves on it: a smaller inertia gets
    an armature added, so that solvers keep their precision."""
    usual_speed_m_s: Positive = 0.3
    """Speed at which a hand lets a drawer go, m/s: where ``stops_within`` starts from ..."""
    usual_speed_rad_s: Positive = 1.0
    """... and a door or lid, rad/s."""
    hold_margin: Positive = 2.0
    """Friction over the gravity load, where it is placed, for a joint that must stay there ..."""
    least_hold_margin: Positive = 1.25
    """... and at least, where more would be too hard for a hand or tip the object over, and where words ask for low
    damping or friction: a laptop's hinges take 1.1 to 1.3 times its screen's weight (typical)."""
    anywhere_hold_margin: Positive = 1.5
    """The same of what is left anywhere, over the load where that is largest: a laptop's screen (0.3 to 0.6 N·m,
    typical), which with more would tip its base as it is opened further."""
    preload_margin: Positive = 1.5
    """Force of a spring over the weight of the part that it presses on its stop: without it a key sags."""
    bump_share: Fraction = 0.25
    """Share of gravity, sideways, that such a joint must bear as well: ground that slopes, and a bump."""
    level_bump_share: Fraction = 0.1
    """The same of a part that slides on the level, at most, so that a drawer moves by a tenth of its weight: balls and
    rollers take 0.01 to 0.05 and their cages drag; waxed wood and plastic on runners take 0.2 (typical)."""
    upright_bump_share: Fraction = 0.03
    """The same of a leaf on upright hinges, which gravity leaves alone on a level floor, at most: no more than its
    default friction, with which it swings on."""
    free_bump_share: Fraction = 0.05
    """The same of a joint that moves freely but is asked to stand somewhere, a door whose weight springs carry,
    and a drawer on "low friction" slides: only as much as lets it stand there ..."""
    free_hold_share: Fraction = 0.3
    """... where gravity's pull is at most this share of its largest: a handle near its balance, a lid past upright."""
    counterbalance_share: Fraction = 0.9
    """Most of its weight that the strut of a lid carries which may fall shut: it must stay down."""
    detent_over_friction: Positive = 2.0
    """Largest effort of a selector's detents over its dry friction: it snaps to a click from all but the last degrees
    before the middle, and takes thrice its friction to turn."""
    strut_share: Fraction = 0.95
    """Share of its weight that the strut of a flap or lid carries that gravity shuts, too heavy for a hand."""
    seal_n: Positive = 15.0
    """Force at a door's edge with which its magnetic gasket lets go, N: refrigerators' typically do so at 10 to 20 N;
    16 CFR 1750.5 allows 66.7 N from inside, IEC 60335-2-24 70 N."""
    seal_travel_m: Positive = 8e-3
    """Way of a door's edge over which its gasket pulls, m: gaskets have bellows of 8 to 12 mm."""
    latch_n: Positive = 20.0
    """Force at a door's edge with which its catch lets go, N: appliances' typically do so at 10 to 40 N; a dishwasher's
    measured at 25 N (15 N·m, Drake's ``DoorHingeConfig``)."""
    latch_travel_m: Positive = 4e-3
    """Way of a door's edge over which its catch pulls, m: a roller or hook of some millimetres."""
    press_shut_n: Positive = 3.0
    """Force at its edge with which a lid that its spring holds ajar is pressed shut, N: the arm of an empty stapler
    (typical: 2 to 6 N; a staple that goes through paper takes 15 to 30 N, and is no part of the object)."""
    default_coast_s: Positive = 0.1
    """Default time constant I_eff / damping, s (design.md: passes in two engines)."""
    default_friction_rad_s2: NonNegative = 0.6
    """Default friction over I_eff of a hinge, rad/s²: with its coast of 1.5 s a door pushed at 1 rad/s swings on by
    28°, of any size; doors without closers do by 20° to 60°."""
    default_friction_m_s2: NonNegative = 0.5
    """Default friction over moved mass of a slider, m/s²: rollers at a coefficient of 0.05."""
    free_friction_share: Fraction = 0.1
    """Share of that friction that is kept where a joint must move freely: without any it would never come to rest."""
    spring_damping_ratio: Positive = 0.5
    """Least damping ratio of a spring-loaded joint: a key that returns without ringing."""
    fallback_density_kg_m3: Positive = 700.0
    """Density where none is stated, kg/m³: between wood and plastic."""
    fallback_hollow_factor: Fraction = 0.3
    """Hollow factor where none is stated: a shell."""
    inertia_factor: Positive = 10.0
    """Largest factor between a proposed inertia or mass and that of the link's shape; beyond it, it is rejected."""
    least_leaf_share: Fraction = 0.1
    """Least stated mass of a door, drawer or lid over that of one built as proposed: those of other hands that were
    weighed have 0.45 or more, and generators of furniture write 0.1 kg, 0.03, for any."""
    least_known_share: Fraction = 0.15
    """Least sum of an object's stated masses over that of the same parts built as the tables say, where they know its
    kind: of other hands' that were weighed it is 0.18 or more, of cupboards of 0.8 m that state 2 kg 0.15 ..."""
    least_unknown_share: Fraction = 0.05
    """... and where they do not: of 67 kinds built as if not known the lightest weigh 0.1 of that."""
    sure_of_closed: Fraction = 0.3
    """Confidence in the closed end from which a joint without a requested state starts closed; below it, at its
    authored zero."""
    default_effort: Positive = 100.0
    """Effort limit written where a joint states none, N·m or N (URDF requires one)."""
    effort_margin: Positive = 4.0
    """Effort limit over what friction and gravity take, at least: no joint may be stuck by its own limit."""
    default_velocity: Positive = 10.0
    """Velocity limit written where a joint states none, rad/s or m/s (URDF requires one)."""
    contact_friction: NonNegative = 0.5
    """Coulomb coefficient of every contact where the overlay names no material."""
    hand_opens_s: Positive = 2.0
    """Time in which a hand takes a part through its range, s: by it a file's damping is felt. Where a hand would need
    more for it than a part of its kind takes, it is not that part's."""
    longest_coast_s: Positive = 60.0
    """Effective inertia over damping, s, beyond which a file's damping brakes nothing: a heavy door on ball bearings
    coasts for some ten seconds."""
    alike_inertia: Positive = 10.0
    """Largest over smallest effective inertia of joints with one and the same damping, friction or spring, beyond which
    that was written for all of them and measured of none."""
    stated_spring_factor: Positive = 5.0
    """Factor by which a file's spring may be stronger than a part of its kind takes at most, or weaker than is felt:
    closers press doors with up to 100 N (140 N·m, EN 1154 size 7), which should take 22.2."""
    least_contact_friction: Positive = 0.03
    """Least Coulomb coefficient that is believed of a file: PTFE on steel has 0.04 ..."""
    most_contact_friction: Positive = 1.5
    """... and most: rubber on dry concrete has 1.0 to 1.2; simulators' files state 100 where parts are to stick."""
    disputed_factor: Positive = 3.0
    """Factor beyond which a model's number stands against a plausible one of a file: a guess within it says nothing
    against an authored number; mistaken units and placeholders are off by ten and more."""
    kept_massless_share: Fraction = 0.01
    """Share of a mass that is kept which a link without geometry takes over: four such links leave it within a
    twentieth of what its file says."""
