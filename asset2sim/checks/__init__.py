"""The interaction checks: what a person would do to an object, recorded; verdicts are made from the records."""
