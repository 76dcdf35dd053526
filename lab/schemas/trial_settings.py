"""The gripper of recorded interactions, and thresholds of their physical judge: what a person would object to."""

from typing import Literal

from schemas.base import Frozen, Positive
from schemas.learning_settings import GuardSettings


class TrialSettings(Frozen):
    """From which value something recorded is a fault. The paper's judges are told what to look for and not how much of
    it; these are about twice what a picture of 512 pixels shows, but for what the paper states."""

    gripper: Literal["panda", "robotiq"] = "panda"
    """The arm's own, or the paper's Robotiq 2F-85, whose model robosuite's package has."""
    moved_rad: Positive = 0.05
    """Turn of the object or of a part that nothing has touched yet, rad: the end of a 10 cm lid moves by 5 mm."""
    moved_m: Positive = 0.005
    """Shift of the object or of a sliding part that nothing has touched yet, m."""
    appeared_m: Positive = 0.002
    """Energy that no tool, spring or weight gave, as the height to which it would lift the object, m."""
    impulse_m_s: Positive = 0.25
    """Speed that the object would have of what such energy comes in one picture (1/15 s), m/s: a jump of 17 mm."""
    overlap_m: Positive = 0.003
    """How deep the tool is in the object, m: what a finger's rubber gives."""
    ringing_rad: Positive = 0.05
    """Amplitude of a part that swings to and fro after it was let go, rad: the paper's, of oscillation."""
    ringing_m: Positive = 0.005
    """The same of a sliding part, m."""
    ringing_turns: int = 3
    """How often it changes direction: the paper's."""
    force_n: Positive = 300.0
    """Force between tool and object that nothing of a household bears, N: twice what a person pushes with one hand."""
    tilt_rad: Positive = GuardSettings().tilt_rad
    """Tilt of an object that is not carried, rad, from which it was tipped: that of the guards of learning."""
