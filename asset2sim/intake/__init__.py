"""What comes in: datasets, formats, the user's own numbers, and what is wrong with a file or an authored number."""
