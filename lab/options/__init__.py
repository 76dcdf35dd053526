"""Options of the commands of the laboratory."""
