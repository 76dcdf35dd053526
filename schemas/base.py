"""The base of every frozen model, and the number types that they share."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Finite = Annotated[float, Field(allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]
Vector3 = tuple[Finite, Finite, Finite]
Inertia6 = tuple[Finite, Finite, Finite, Finite, Finite, Finite]
"""Symmetric 3x3 inertia as (ixx, ixy, ixz, iyy, iyz, izz), kg·m² unless a field says otherwise."""


class Frozen(BaseModel):
    """An immutable record that refuses fields it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid")
