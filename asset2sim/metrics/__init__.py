"""The paper's measures of interaction-readiness, as pure functions over what an engine recorded."""
