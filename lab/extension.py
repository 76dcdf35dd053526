"""Extension of the laboratory to ``asset2sim``: its commands, tables, model and methods."""

from lab.noise.noise_level import NOISY, NOISY_FORM, NOISY_LABEL
from schemas.declared import METHOD, TOOLS, DeclaredCommand, Extension, LocalModel

COMMANDS = (
    DeclaredCommand(
        "rate", "a page on which people rate anonymous variants",
        "lab.options:RateOptions", "lab.flows.rate:serve_rating",
    ),
    DeclaredCommand(
        "judge-videos", "films of recorded interactions, scored by models side by side",
        "lab.options:JudgeVideosOptions", "lab.flows.judge_films:judge_films",
    ),
    DeclaredCommand(
        "ratings", "what people and judges made of variants, per method",
        "lab.options:RatingsOptions", "lab.flows.rate:print_ratings",
    ),
    DeclaredCommand(
        "record-motion", "a scripted arm's tasks with refined objects, filmed and judged",
        "lab.options:RecordMotionOptions", "lab.flows.record_motion:record_motion",
    ),
    DeclaredCommand(
        "probe", "a policy's tasks with refined objects, asked over a socket",
        "lab.options:ProbeOptions", "lab.flows.probe:probe",
    ),
    DeclaredCommand(
        "learn", "a robot learns to use refined objects: PPO, resumable",
        "lab.options:LearnOptions", "lab.flows.learn:learn",
    ),
)  # fmt: skip
SIMULATED = LocalModel(
    name=NOISY, form=NOISY_FORM, label=NOISY_LABEL, answers="lab.noise.noise:noisy_answers", sources=("lab.noise",)
)
EXTENSION = Extension(
    commands=COMMANDS,
    models=(SIMULATED,),
    tables="lab.schemas.tables:JUDGED",
    declares={METHOD: ("lab.methods",)},
    offline={
        "direct": "lab.methods.final_numbers:final_overlay",
        "ivw": "lab.methods.final_numbers:with_sigmas",
        TOOLS: "lab.methods.agent.offline:next_turn",
    },
)
