"""Data and output behind URLs: what assets are there, fetching them, and sending what was made."""
