"""Settings and tables of the laboratory."""
