"""One controller for one command: the cell, the password, warnings before a write."""
