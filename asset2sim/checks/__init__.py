"""The interaction tests: what a person would do to an object, as frozen records; verdicts are elsewhere."""
