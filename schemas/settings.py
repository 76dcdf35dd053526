"""Every number that steers a run, in one frozen place, each with its unit and its reason."""

from pydantic import Field

from schemas.base import Fraction, Frozen, NonNegative, Positive
from schemas.extensions import CheckName as CheckName
from schemas.inputs import InputSettings as InputSettings
from schemas.model_names import ModelSettings as ModelSettings
from schemas.model_names import is_prior
from schemas.physics_settings import PhysicsSettings as PhysicsSettings
from schemas.secret import Secret
from schemas.support import SupportKind
from schemas.thresholds import Thresholds as Thresholds
from schemas.vocabulary import (
    BaseMode,
    CollisionMode,
    Correction,
    Engine,
    Export,
    Gate,
    Method,
    Proposer,
    Redo,
    StateMode,
    UpAxis,
)


class RunSettings(Frozen):
    """How a dataset is spread over processes, and what one asset may use."""

    workers: int = Field(2, ge=1)
    scheduler: str | None = None
    asset_time_limit_s: Positive = 300.0
    """Wall time of one asset, s: the slowest of the real objects, a keyboard of 115 keys, needs about a tenth of it."""
    asset_memory_limit_mb: int = Field(4096, ge=256)
    """Address space that one asset's process may add, MB."""
    retries_alone: int = Field(20, ge=0)
    """Most assets of a run that are tried once more, one after the other, after their process died: hundreds that hang
    for five minutes each would take the night. The next run tries the others."""
    max_model_errors: int = Field(5, ge=0)
    """Assets in a row that the model fails with the same error, from which on no further one is tried: a wrong key or a
    server that is down fails them all. The next run tries the rest. 0: all are tried."""
    max_timeouts: int = Field(3, ge=0)
    """Runs in a row in which an asset took too long, from which on it is left until it, the code, the settings or a
    longer ``asset_time_limit_s`` give another try. 0: every run tries."""
    worker_memory_mb: int = Field(768, ge=1)
    """Memory that one asset at work takes of this machine's, MB, by which ``workers`` is bounded: of 15 real objects in
    three engines the heaviest (a box whose 376 meshes have 9 MB) took 485 MB, the median 284 MB."""
    own_memory_mb: int = Field(1536, ge=0)
    """Memory that a run takes besides, MB: itself (690 for 1,000 assets), Prefect's server (200), the process of which
    the assets' are forked (180), and room for larger datasets."""
    min_success: Fraction | None = None
    """Gate: least share of the run's assets, unchanged ones included, that must pass; None: any."""
    max_new_failures: int | None = Field(None, ge=0)
    """Gate: most assets that may fail that did not fail before the run; None: any number."""
    gate: Gate = Gate.ERROR
    """Action of a run that misses a gate: an exit code of its own, or a warning."""
    hook: Secret | None = None
    """A shell command to run after the run, with the run's figures in its environment."""
    hook_time_limit_s: Positive = 60.0
    """Wall time of the hook, s: enough for a slow mail server, and a run is not held up by one that never answers."""
    report: bool = True
    """Whether a run writes its report for people, ``OUT/report``; of objects that it left unchanged nothing is made."""
    keep_days: int | None = Field(None, ge=1)
    """How long the history's rows and MLflow's artifacts of a run are kept, days; None for ever. The newest run over
    each dataset stays in any case."""
    redo: Redo = Redo.CHANGED
    """Which assets are refined again although an earlier run has their result."""


class DoubtSettings(Frozen):
    """When a model is asked about the same object again: once with what its answer comes to, or for several answers."""

    ask_again: bool | None = None
    """Whether a model is asked once more where what its answer comes to is further from what words and kind lead one to
    expect than its own σ, and the second answer is taken; null: by any model but ``prior/household`` and
    ``prior/noisy``, unless ``correct`` is semantic."""
    samples: int = Field(1, ge=1)
    """Most answers to one question, of which the median is taken; more than one only where σ, or the difference of two
    answers, is above the σ below."""
    sample_temperature: NonNegative = 0.7
    """Temperature at which the others are asked: at zero they would all be the same."""
    scale_sigma: Positive = 0.35
    """Relative σ of a scale for which a model states none: one answer of the paper's models is 35 % off."""
    prior_scale_sigma: Positive = 0.17
    """σ of the scale that ``prior/household`` expects: what that is off itself. Both count for the difference."""
    position_sigma: Fraction = 0.15
    """σ of an asked position for which a model states none, as a share of the part's useful travel: half the way from
    slightly open to half open, beyond which a state reads as another word ..."""
    prior_position_sigma: Fraction = 0.1
    """... and that of the expected one: what the search may move a joint by without leaving the state."""


class ViewSettings(Frozen):
    """The five canonical views."""

    width: int = Field(320, ge=16)
    height: int = Field(320, ge=16)
    write: bool = True
    """Whether views of the refined state are written beside it; ``asset2sim views`` writes those that are missing."""


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
    steady_share: Fraction = 0.2
    """A drop or a perturbed start ends early, too, where the object only trembles or coasts on, and until its time is
    over would move by less than this share of what decides: a fifth leaves room for what is not so even."""
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
    cut_primitives: bool = False
    """Whether boxes and cylinders of the file collide as hulls, which can be cut. Else that is tried where an object
    fails, or starts elsewhere than asked, with them as they are."""


class SearchSettings(Frozen):
    """The closed loop over joint positions."""

    target_phi_m: NonNegative = 1e-4
    """ε: Φ at which the search is done, m."""
    state_tolerance: Fraction = 0.095
    """How far, as a share of its range, a joint may be moved from the requested state without leaving it: a little less
    than it may settle away from it (``Thresholds.state_share``), as what is placed there still settles ..."""
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
    """Most model calls about an asset's state where the search proposes, repeats included: where parts
    overlap."""


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
    """How far our rules move a model's answer; null: semantic for ``prior/household`` and
    ``prior/noisy``, whose tables they are, and units for every other model. What users state as numbers of their own is
    never moved."""
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
