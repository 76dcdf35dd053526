"""The simulated fallible model: the offline prior with seeded errors."""
