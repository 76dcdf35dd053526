"""MuJoCo's options and constraint parameters, one set for checks and exported MJCF: an export behaves as measured."""

from collections.abc import Container

WORLD = "world"
"""The name of MuJoCo's own body, which no link's may bear: many a URDF calls its root so."""
IMPEDANCE = 0.9999
"""Impedance d of MuJoCo's constraints, springs and dampers that yield to the share 1 - d of the load; 0.9999 is the
stiffest that it allows. At its usual 0.9 to 0.95 a lid that dry friction holds creeps by 0.01 rad/s."""
CONTACT_IMPEDANCE = 0.99
"""Of contacts and limits: at MuJoCo's 0.95 light objects sink a millimetre and rock, and harder ones chatter."""
SOFT_WIDTH_M = 1e-3
"""Depth, m, over which a contact reaches its full impedance; MuJoCo's own."""
REFERENCE_STEPS = 3.0
"""Time constant of constraints in time steps: 12.5 ms at 240 Hz, where MuJoCo's own is 20 ms. At 2, the shortest that
it allows, objects that stand on three points chatter and wander by millimetres; longer, and what falls sinks in."""
FRICTION_RATIO = 100.0
"""How much stiffer friction is than contact (impratio): at 1 a block creeps down a slope by 2 mm/s."""
ROLLING_DIMENSION = 6
"""Dimension of contacts that resist sliding, spinning and rolling: of an object that is given rolling resistance."""
TORSION_M, ROLLING_M = 5e-3, 1e-4
"""MuJoCo's own coefficients of spinning and rolling friction, m; contacts of dimension 3 use neither."""
SOLVER_ITERATIONS = 100
SOLVER_TOLERANCE = 1e-10
"""Where Newton's method stops; at MuJoCo's 1e-8 light parts on heavy ones keep a residual motion."""
LOCKED_RANGE = 1e-6
"""Range, rad or m, of a joint whose lower and upper limit are the same: MuJoCo would read them as no limit."""

FRICTION_SOLIMP = (IMPEDANCE, IMPEDANCE, 1.0, 0.5, 2.0)
"""``solimp`` of dry friction, and of mimics, which else yield to the friction of the joint that follows."""
LIMIT_SOLIMP = (CONTACT_IMPEDANCE, CONTACT_IMPEDANCE, 1.0, 0.5, 2.0)
ARMATURE_LIMIT_SOLIMP = (IMPEDANCE, IMPEDANCE, 1.0, 0.5, 2.0)
"""``solimp`` of the limits of joints with an armature. MuJoCo scales a limit's stiffness by its estimate of what the
joint moves, without the armature: at ``LIMIT_SOLIMP`` a spring of 0.5 N presses a key of 1 g through its stop by 0.7 mm
at 240 Hz, at this by 8 µm."""
CONTACT_SOLIMP = (CONTACT_IMPEDANCE - 0.04, CONTACT_IMPEDANCE, SOFT_WIDTH_M, 0.5, 2.0)
"""``solimp`` of joints' dry friction, of joint limits and of contacts."""


def solref(timestep_s: float) -> tuple[float, float]:
    """Time constant, s, and damping ratio of every constraint at this time step."""
    return REFERENCE_STEPS * timestep_s, 1.0


def bias_name(joint: str) -> str:
    """The name of the actuator that is what a joint's mechanism exerts; no control moves it."""
    return f"{joint}_mechanism"


def body_name(link: str, links: Container[str]) -> str:
    """The name of a link's body: its own, or where that is MuJoCo's own ``world`` another that no link has."""
    name = link
    while name == WORLD or (name != link and name in links):
        name += "_link"
    return name
