"""Types of the laboratory's options, as ``asset2sim.runs.option_types`` has the product's."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field
from typing_extensions import TypeAliasType

from schemas.base import Positive
from schemas.vocabulary import Method


def actions(text: object) -> object:
    """A number of actions, also as 2e6."""
    try:
        return int(float(text)) if isinstance(text, str) else text
    except (ValueError, OverflowError):
        return text  # which is refused as no whole number


def methods_named(names: tuple[str, ...]) -> tuple[str, ...]:
    """Names of methods; ``ours`` is Asset2Sim's. Raises ValueError."""
    found = tuple(Method.ASSET2SIM.value if name == "ours" else name for name in names)
    for name in found:
        if name not in set(Method):
            raise ValueError(f"'{name}' is no method; choose from ours, {', '.join(Method)}")
    return found


STEPS = TypeAliasType("STEPS", Annotated[int, BeforeValidator(actions), Field(ge=1)])
MINUTES = TypeAliasType("MINUTES", Positive)
METHODS = TypeAliasType("METHODS", tuple[Method, ...])
FOLDER = TypeAliasType("FOLDER", Path)
GRIPPER = TypeAliasType("GRIPPER", Literal["panda", "robotiq"])
ACTIONS = TypeAliasType("ACTIONS", Literal["joint_velocity", "joint_position"])
CAMERA = TypeAliasType("CAMERA", Literal["left", "right"])
