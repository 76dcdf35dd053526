"""Settings of the laboratory: how a policy is trained, what a policy behind a socket may take, and what is a fault of a
recorded interaction."""

from typing import Literal

from pydantic import Field

from schemas.base import Fraction, Frozen, NonNegative, Positive
from schemas.learning_settings import GuardSettings


class PpoSettings(Frozen):
    """How a policy is trained: PPO of stable-baselines3, the same numbers for every object and method. The paper
    publishes none; where the library's own do, they are kept."""

    physics: Literal["mujoco", "warp"] = "mujoco"
    """MuJoCo on the processor, or MuJoCo Warp with all environments at once; rollouts that judge a policy, and their
    guards, are MuJoCo's in both."""
    device: Literal["cpu", "auto"] = "cpu"
    """Where the policy, and Warp's worlds, are: the processor, or a GPU where there is one."""
    environments: int = Field(8, ge=1)
    """Environments of a training, all in one process of one thread: together with ``rollout`` it makes a batch."""
    rollout: int = Field(256, ge=2)
    """Actions of each between two updates: one episode of 10 s and a half, so that a batch sees whole ones."""
    minibatch: int = Field(256, ge=2)
    """Samples of a gradient step: 64 (the library's) costs four times the time here, and learns as fast."""
    epochs: int = Field(8, ge=1)
    """Passes over a batch: simulating costs more than learning, so about as many as the library's 10."""
    learning_rate: Positive = 3e-4
    """Of Adam: the library's."""
    discount: Fraction = 0.99
    """Of an action of 80 ms: what comes 8 s later counts e⁻¹, so the whole episode is in sight."""
    smoothing: Fraction = 0.95
    """λ of the generalised advantage: the library's."""
    clip: Positive = 0.2
    """Of the policy's ratio: the library's."""
    most_divergence: Positive = 0.03
    """Divergence from the policy that acted at which an update ends early: twice the usual bound of 0.015."""
    entropy: NonNegative = 0.0
    """Weight of the policy's entropy: the library's; the noise below explores."""
    critic_sees_object: bool = True
    """Whether the critic, as the paper's, sees more than the actor: how far the object itself was moved and how fast
    it moves, which decides whether an episode is lost and which nothing that the actor sees tells."""
    hidden: tuple[int, ...] = (128, 128)
    """Neurons of the layers of actor and critic, each its own: 38 numbers in, 7 out."""
    noise_log_std: float = -1.5
    """Logarithm of the noise's scale at the start, of weights whose sum over a layer is the action's noise."""
    noise_actions: int = Field(4, ge=0)
    """Actions for which a direction of exploring is kept (generalised state-dependent exploration): noise that is drawn
    anew at each action averages out within a contact, and a door is never pushed. 0: drawn anew."""
    checkpoint_steps: int = Field(16_384, ge=1)
    """Actions between two checkpoints, rounded up to whole batches: eight."""
    checkpoint_rollouts: int = Field(9, ge=1)
    """Rollouts, without noise, that give a checkpoint's S: the paper's set of nine, a fourteenth of the simulation."""
    held: int = Field(2, ge=1)
    """Checkpoints in a row all of whose rollouts succeed, after which training ends: once may be luck."""
    rollouts: int = Field(18, ge=1)
    """Rollouts of the chosen checkpoint that give the success rate: the paper's, in multiples of nine."""
    memory_mb: int = Field(8192, ge=512)
    """Address space that a training's process may add, MB: torch alone maps two to three thousand."""


def warp_settings(environments: int) -> PpoSettings:
    """Settings for so many environments in MuJoCo Warp, on a GPU where there is one. A batch has 32 actions of each
    where there are thousands, as training with thousands is done (the paper does not say), but never less than the
    2048 of the processor's; it is gone through in sixteen parts, or in parts of 256."""
    rollout = max(32, 2048 // environments)
    batch = rollout * environments
    return PpoSettings(
        physics="warp", device="auto", environments=environments, rollout=rollout,
        minibatch=max(256, batch // 16), checkpoint_steps=max(16_384, 4 * batch),
        memory_mb=1 << 20,  # CUDA maps what it may ever use
    )  # fmt: skip


class ProbeSettings(Frozen):
    """How long and how often a policy's server is asked before a trial ends without it."""

    connect_s: Positive = 20.0
    """Time for a first connection, s: a server that is just starting is tried again and again meanwhile."""
    reconnect_s: Positive = 5.0
    """Time for another connection where one broke in the middle of an episode, s: the question is then put again."""
    first_answer_s: Positive = 180.0
    """Time for the first answer over a connection, s: JAX compiles a policy when it is first asked."""
    answer_s: Positive = 30.0
    """Time for every other answer, s: real policies take 0.1 to 0.5."""
    most_bytes: int = 16 * 1024 * 1024
    """Largest frame that is read. An answer of 15 actions has a kilobyte."""
    most_actions: int = 1000
    """Longest chunk that is accepted; the policies in use answer 10 to 32."""
    trial_s: Positive = 900.0
    """Wall time of one trial, s."""
    trial_mb: int = 6144
    """Memory that one trial's process may add, MB."""
    unreachable_in_a_row: int = 3
    """So many trials in a row that found no server end the run: the rest waits for the next one."""


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
