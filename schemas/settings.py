"""Every number that steers a run, in one frozen place, each with its unit and its reason."""

from typing import Literal

from pydantic import Field

from schemas.base import Fraction, Frozen, NonNegative, Positive
from schemas.doubt_settings import DoubtSettings as DoubtSettings
from schemas.extensions import CheckName as CheckName
from schemas.inputs import InputSettings as InputSettings
from schemas.model_names import ModelSettings as ModelSettings
from schemas.model_names import is_prior
from schemas.run_settings import RunSettings as RunSettings
from schemas.support import SupportKind
from schemas.thresholds import Thresholds as Thresholds
from schemas.view_settings import ViewSettings as ViewSettings
from schemas.vocabulary import (
    BaseMode,
    CollisionMode,
    Correction,
    DynamicsRule,
    Engine,
    Export,
    Method,
    Proposer,
    StateMode,
    UpAxis,
)


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
    """Time step of whoever loads a URDF without armature, which no URDF holds, s: PyBullet's own."""
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
    """Friction over the gravity load for a joint that must stay where it is placed: at 1.5 a laptop's screen creeps
    in solvers whose contacts are stiffer than their dry friction ..."""
    least_hold_margin: Positive = 1.25
    """... and at least, where more would be too hard for a hand or tip the object over."""
    preload_margin: Positive = 1.5
    """Force of a spring over the weight of the part that it presses on its stop: without it a key sags."""
    bump_share: Fraction = 0.25
    """Share of gravity, sideways, that such a joint must bear as well: ground that slopes, and a bump."""
    upright_bump_share: Fraction = 0.03
    """The same of a leaf on upright hinges, which gravity leaves alone on a level floor: what their pins rub, so that
    it swings on by a third of a radian (Shigley: 0.1 to 0.2 of the load, on pins of a tenth of the leaf's reach)."""
    free_bump_share: Fraction = 0.05
    """The same of a joint that moves freely but is asked to stand somewhere: only as much as lets it stand there ..."""
    free_hold_share: Fraction = 0.3
    """... where gravity's pull is at most this share of its largest: a handle near its balance, a lid past upright."""
    counterbalance_share: Fraction = 0.9
    """Share of an open door's weight that its springs carry, where such doors have springs: it must stay down."""
    default_coast_s: Positive = 0.1
    """Default time constant I_eff / damping, s (design.md: passes in two engines)."""
    default_friction_rad_s2: NonNegative = 1.0
    """Default friction over I_eff of a hinge, rad/s²: it stops a slow swing within a second."""
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


class EngineSettings(Frozen):
    """How the simulator is run."""

    timestep_s: Positive = 1.0 / 240.0
    """PyBullet's own default and the step its solver is tuned for, s."""
    settle_s: Positive = 6.0
    """T_set at most: time to come to rest before the reference pose is taken, s; a clock that topples needs four."""
    still_s: Positive = 0.25
    """Settling ends early once nothing has moved for this long, s ..."""
    still_speed: Positive = 3e-4
    """... where moving means a link above this speed, m/s (over the test it would drift 0.6 mm of the 1 mm allowed),
    or the root turning or a joint moving above ten times it, rad/s or m/s."""
    test_s: Positive = 2.0
    """T_test: time over which drift and oscillation are measured, s."""
    drop_height_m: NonNegative = 2e-4
    """Height at which the object is set over the plane, m: it never starts inside, and lands at 0.06 m/s, too slow to
    shake a lid loose."""
    verify: tuple[Engine, ...] | None = None
    """Engines in which a refined asset is checked; None stands for all that are installed. Refinement uses PyBullet."""
    decide: tuple[Engine, ...] | None = None
    """Those of them whose verdicts decide; what the others measure is recorded. None stands for all."""
    interact: bool = True
    """Whether the interaction checks run, besides the paper's three."""
    coarse_timestep_s: Positive = 1.0 / 60.0
    """The coarse step at which the drop is repeated, s: robot learning runs at 60 Hz."""
    time_limit_s: Positive = 120.0
    """Wall time of one engine's verification of one asset, s; its process is killed then."""
    fall_height_m: Positive = 0.05
    """Height of the drop check, m."""
    fall_s: Positive = 6.0
    """Time after a drop or a perturbed start by which the object must be at rest, s."""
    nudge_rad_s: Positive = 1.0
    """Speed that a nudge gives a hinge, rad/s: a push with a finger ..."""
    nudge_m_s: Positive = 0.2
    """... or a slider, m/s."""
    nudge_s: Positive = 2.0
    """Time that a nudged joint is given, s."""
    hold_s: Positive = 2.0
    """Time over which a joint must stay where it is placed, s."""
    release_s: Positive = 6.0
    """Longest time that a released joint is given, s."""
    push_s: Positive = 1.0
    """Time over which the effort on a joint is raised until it moves, s."""
    sweep_samples: int = Field(25, ge=3)
    """Positions of a joint at which a sweep looks for overlaps."""
    resets: int = Field(8, ge=0)
    """Perturbed starts."""
    reset_share: Fraction = 0.05
    """How far the joints of a fixed object are moved in its perturbed starts, as a share of each range."""
    reset_m: Positive = 0.02
    """Largest shift of a perturbed start along each axis, m ..."""
    reset_rad: Positive = 0.035
    """... and its largest tilt about each, rad (two degrees)."""


class CollisionSettings(Frozen):
    """How collision geometry is made, and its limits."""

    mode: CollisionMode = CollisionMode.DECOMPOSE
    cutter: Literal["faces", "coacd"] = "faces"
    """What cuts a concave shell: its own faces, grouped so that hollows stay empty, or CoACD (V-HACD for open meshes),
    which fills more, leaves faces out, and takes 5 to 20 times as long on the real objects."""
    max_link_hulls: int = Field(48, ge=1)
    """Most convex pieces of one link: contacts get slower with each."""
    max_asset_hulls: int = Field(256, ge=1)
    """Most convex pieces of an asset: beyond it those of the links with most are joined where that fills least."""
    hollow_m: Positive = 0.04
    """A hollow counts where a ball of this diameter gets into it from outside, m ..."""
    hollow_share: Fraction = 0.05
    """... or of this share of the object's longest extent, whichever is smaller: 2 cm on 40 cm."""
    sheet_thickness_m: Positive = 2e-3
    """Thickness given to flat shapes, m: engines refuse or lose shapes without one."""


class SearchSettings(Frozen):
    """The closed loop over joint positions."""

    target_phi_m: NonNegative = 1e-4
    """ε: Φ at which the search is done, m."""
    state_tolerance: Fraction = 0.10
    """How far, as a share of its range, a joint may be moved from the requested state without leaving it ..."""
    closed_tolerance: Fraction = 0.02
    """... and how far, at first, where that state is its closed end: a drawer that is a tenth open is not closed."""
    least_gain: Fraction = 0.10
    """Share of Φ by which a move must lower it: a state is not left for less."""
    max_evaluations: int = Field(4000, ge=1)
    """Evaluations of Φ per asset; one costs 5 to 30 µs on these objects."""
    mend_rounds: int = Field(12, ge=0)
    """Most rounds of changing parameters and measuring again while a check fails."""
    mend_factor: Positive = 3.0
    """By how much damping and friction grow each time (the paper: ×2 to ×5 on persistent oscillation)."""
    rolling_resistance: NonNegative = 0.02
    """Least friction of a joint that moves untouched, as a share of the object's weight on a lever of the part's own
    size: castors on a hard floor have 0.01 to 0.03."""
    proposer: Proposer = Proposer.SEARCH
    """What proposes states: a search first, or a model at every step (paper, "Refine the state")."""
    max_iterations: int = Field(25, ge=0)
    """Most iterations of the loop in which a model proposes every step, and most model calls about an asset's state
    there, repeats included (the paper: 25)."""
    max_model_calls: int = Field(2, ge=0)
    """Most model calls about an asset's state where the search proposes, repeats included: where it left overlap or the
    requested state, or a joint fell."""


class MethodSettings(Frozen):
    """Limits of the baseline methods (paper, baselines)."""

    ivw_queries: int = Field(5, ge=1)
    """Answers per view; with the five views 25 calls an asset."""
    ivw_temperature: NonNegative = 0.7
    """Temperature at which they are asked: at zero 25 answers would be 5."""
    agent_steps: int = Field(12, ge=1)
    """Answers that an agent may give, tool calls included."""
    raw_asked: bool = False
    """Whether a raw asset's joints that its file leaves closed are asked to stay so: for planted defects, whose objects
    were refined to that state. An authored asset has no requested state."""


class Settings(Frozen):
    """Everything that steers a run."""

    method: Method = Method.ASSET2SIM
    methods: MethodSettings = MethodSettings()
    model: ModelSettings = ModelSettings()
    correct: Correction | None = None
    """How far our rules move a model's answer; null: semantic for the offline prior, whose tables they are, and
    units for every other model. What users state as numbers of their own is never moved."""
    doubt: DoubtSettings = DoubtSettings()
    inputs: InputSettings = InputSettings()
    physics: PhysicsSettings = PhysicsSettings()
    engine: EngineSettings = EngineSettings()
    collision: CollisionSettings = CollisionSettings()
    up: UpAxis | None = None
    """Which axis points up in the files of all assets whose manifest row does not say; None: found out, else z."""
    state: StateMode = StateMode.DOCUMENT
    support: SupportKind | None = None
    """What carries every object whose manifest row does not say; None: found for each."""
    prompt: str | None = None
    """What is asked of the one asset of a run, whatever its manifest row asks; a run of several refuses it."""
    base: BaseMode = BaseMode.ROOT
    exports: tuple[Export, ...] = ()
    search: SearchSettings = SearchSettings()
    thresholds: Thresholds = Thresholds()
    checks: tuple[CheckName, ...] = ()
    """Further checks of what was written, each seconds an object; they warn, and decide nothing."""
    views: ViewSettings = ViewSettings()
    run: RunSettings = RunSettings()

    @property
    def correction(self) -> Correction:
        """How far the answer is moved; names and words count for nothing where they are withheld."""
        chosen = self.correct or (Correction.SEMANTIC if is_prior(self.model.model) else Correction.UNITS)
        return Correction.UNITS if chosen is Correction.SEMANTIC and not self._semantics else chosen

    @property
    def asks_again(self) -> bool:
        """Whether a doubtful answer is asked about once more."""
        usual = not is_prior(self.model.model) and self.correction is not Correction.SEMANTIC
        return self._semantics and (usual if self.doubt.ask_again is None else self.doubt.ask_again)

    @property
    def _semantics(self) -> bool:
        return self.method is not Method.NO_SEMANTICS
