"""The models that run in this process, by name."""

PRIOR_PROVIDER = "prior"
PRIOR_MODELS: tuple[str, ...] = ("prior/household",)


def is_prior(model: str) -> bool:
    """Whether the model runs in this process, whatever its name says after the slash."""
    return model.split("/", 1)[0] == PRIOR_PROVIDER
