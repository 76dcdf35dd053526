"""The simulated fallible model: ``prior/household`` with seeded errors."""
