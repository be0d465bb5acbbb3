"""sim run: many simulated controllers of all kinds, from a file."""
