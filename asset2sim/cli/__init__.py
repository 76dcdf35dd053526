"""The command line: one module per command. What starts flows is handed in from above, so nothing here imports them."""
