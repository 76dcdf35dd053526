"""Enumerations of the values that tables, files and options may hold."""

from enum import StrEnum

from schemas.csv_rows import rows_beside
from schemas.declared import OpenValues


class FailureMode(OpenValues):
    """Why an asset failed; the paper's five modes map onto these (``PAPER_FAILURE_MODES``)."""

    NONE = "none"
    UNREADABLE_ASSET = "unreadable_asset"
    MISSING_MESH = "missing_mesh"
    NO_VALID_ESTIMATE = "no_valid_estimate"
    INVALID_JOINT_CONFIGURATION = "invalid_joint_configuration"
    PENETRATION = "penetration"
    DRIFT = "drift"
    OSCILLATION = "oscillation"
    STANDS = "stands"
    STATE = "state"
    DROP = "drop"
    NUDGE = "nudge"
    JAM = "jam"
    HOLD = "hold"
    RELEASE = "release"
    RESET = "reset"
    EFFORT = "effort"
    ENGINE_REFUSED = "engine_refused"
    ENGINE_CRASH = "engine_crash"
    OUT_OF_MEMORY = "out_of_memory"
    TIMEOUT = "timeout"
    DISK_FULL = "disk_full"
    MODEL_ERROR = "model_error"
    BUDGET = "budget"


FAILURE_ROWS = {FailureMode(row["mode"]): row for row in rows_beside(__file__, "failure_modes.csv")}
"""Failure mode → its row: the paper's name for it, whether every run tries it ``again``, and where no check shows it,
its ``cause`` and ``remedy``."""
PAPER_FAILURE_MODES = {mode: row["paper"] for mode, row in FAILURE_ROWS.items() if row["paper"]}
"""Our failure mode → the paper's name for it, as used for its large set. The paper has none for limits of time and
memory and a full disk, which say nothing of the object."""
RETRIED_MODES = tuple(mode for mode, row in FAILURE_ROWS.items() if row["again"])
"""Failure modes that may come of the machine, the provider or the day, not of the asset: tried again in every run. All
others would come out as they did."""
NOT_MEASURED = (
    *(FailureMode.ENGINE_REFUSED, FailureMode.ENGINE_CRASH, FailureMode.OUT_OF_MEMORY, FailureMode.TIMEOUT),
)
"""Failure modes of an engine that measured nothing."""


class Status(StrEnum):
    """How an asset ended."""

    OK = "ok"
    FAILED = "failed"


class Stage(StrEnum):
    """The stages of one asset, in order."""

    EXTRACT = "extract"
    SYNTHESIZE = "synthesize"
    VALIDATE = "validate"
    APPLY = "apply"
    REFINE = "refine"
    MEASURE = "measure"
    ALIGN = "align"
    PUBLISH = "publish"


class Severity(StrEnum):
    """How much a finding matters: an ``error`` fails the asset, a ``warning`` changed something, ``info`` explains."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


class Source(StrEnum):
    """Where a number came from."""

    USER = "user"
    MODEL = "model"
    PRIOR = "prior"
    RULE = "rule"
    SEARCH = "search"
    AUTHORED = "authored"


class VolumeSource(StrEnum):
    """How a volume was obtained."""

    SIGNED = "signed"
    HULL = "hull"
    BOX = "box"
    MIXED = "mixed"
    NONE = "none"


class MassRule(StrEnum):
    """How a link's mass was made.

    ``solid`` is volume × density × hollow factor, ``shell`` outer area × wall × density, both with what is inside;
    ``stated`` a mass as given by a model or the URDF; ``bounded`` one that a rule replaced; ``shared`` a part of a
    neighbour's, or the least, for a link without geometry.
    """

    SOLID = "solid"
    SHELL = "shell"
    STATED = "stated"
    BOUNDED = "bounded"
    SHARED = "shared"


class Method(OpenValues):
    """Where an asset's physics come from; each says what it is where it is declared."""

    ASSET2SIM = "asset2sim"
    DIRECT = "direct"
    IVW = "ivw"
    REFERENCE = "reference"
    NO_SEMANTICS = "no-semantics"
    AGENT = "agent"
    CONSTANT = "constant"
    RAW = "raw"


class Engine(OpenValues):
    """The simulators that an asset can be checked in."""

    PYBULLET = "pybullet"
    MUJOCO = "mujoco"
    SAPIEN = "sapien"


class OverlapCause(StrEnum):
    """Why two links overlap: the authored meshes do, or only the convex shapes that stand for them; or a link overlaps
    the floor on which the object stands."""

    AUTHORED = "authored"
    HULL = "hull"
    FLOOR = "floor"


class CollisionMode(StrEnum):
    """How collision geometry is made. ``keep`` leaves it as authored, missing files dropped; ``repair`` writes one
    convex hull per shell, sheets thickened; ``decompose`` also cuts concave meshes into convex pieces, so that what is
    hollow stays hollow."""

    KEEP = "keep"
    REPAIR = "repair"
    DECOMPOSE = "decompose"


class DynamicsRule(StrEnum):
    """Where joint dynamics come from: ``inertia`` and time constants, or the ``paper``'s absolute ranges."""

    INERTIA = "inertia"
    PAPER = "paper"


class Proposer(StrEnum):
    """Proposer of joint positions that lower Φ: a ``search``, which asks a model only where overlap is left, or the
    ``model``
    at every step (the paper's loop)."""

    SEARCH = "search"
    MODEL = "model"


class Redo(StrEnum):
    """Which assets a run refines again: those that ``changed``, those that ``failed`` too, or ``all``."""

    CHANGED = "changed"
    FAILED = "failed"
    ALL = "all"


class Grouping(StrEnum):
    """Columns by which failures can be counted."""

    FAILURE_MODE = "failure_mode"
    CATEGORY = "category"
    SUBSET = "subset"
    METHOD = "method"
    MODEL = "model"
    ASSET = "asset_id"


class Gate(StrEnum):
    """Action of a run that misses a gate: ``error`` exits with 3, ``warn`` says so and exits as without a gate."""

    WARN = "warn"
    ERROR = "error"


class Correction(StrEnum):
    """How far rules move what a model says: ``off`` only where no engine could step it, ``units`` also numbers that are
    plainly in another unit, ``semantic`` also the scale to ``prior/household``'s table of sizes and the state to its
    reading of the words."""

    OFF = "off"
    UNITS = "units"
    SEMANTIC = "semantic"


class Keep(StrEnum):
    """Which authored numbers stay: ``plausible`` ones of a file in metres, ``all`` possible ones, or ``nothing``."""

    PLAUSIBLE = "plausible"
    ALL = "all"
    NOTHING = "nothing"


class Quantity(StrEnum):
    """A quantity of an object's physics that its file may state."""

    SIZE = "size"
    MASS = "mass"
    CENTRE = "centre"
    INERTIA = "inertia"
    DAMPING = "damping"
    FRICTION = "friction"
    SPRINGS = "springs"
    LIMITS = "limits"
    START = "start"
    CONTACT = "contact"
    SHAPES = "shapes"


class Trust(StrEnum):
    """How far a file's number is believed: nothing is said, impossible for a body, odd for such a part, or likely."""

    ABSENT = "absent"
    IMPOSSIBLE = "impossible"
    DOUBTFUL = "doubtful"
    PLAUSIBLE = "plausible"


class StateMode(StrEnum):
    """How the initial state is written: ``document`` keeps the authored zero and states the positions beside it;
    ``bake`` writes a URDF whose zero is the state."""

    DOCUMENT = "document"
    BAKE = "bake"


class BaseMode(StrEnum):
    """How the written URDF says that an object is fixed. URDF has no word for it: ``root`` leaves it to the loader's
    flag, which all engines have; ``world`` hangs the root from a link of that name by a fixed joint, which Drake,
    Gazebo and ROS take for the world."""

    ROOT = "root"
    WORLD = "world"


class UpAxis(StrEnum):
    """Which axis of an asset's root link points up in its file."""

    X = "x"
    Y = "y"
    Z = "z"
    MINUS_X = "-x"
    MINUS_Y = "-y"
    MINUS_Z = "-z"


class Export(StrEnum):
    """Formats written beside the URDF."""

    MJCF = "mjcf"
    USD = "usd"
    SDF = "sdf"


DECIDING_PACKAGES = ("lxml", "numpy", "pillow", "pycollada", "python-fcl", "scipy", "trimesh", "usd-core", "xacro")
"""Packages, beside the engines (``Engine``), whose version may change a number in an asset's result."""
