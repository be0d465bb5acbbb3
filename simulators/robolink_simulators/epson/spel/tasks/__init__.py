"""SPEL+ tasks: programs in progress, side by side, in simulated time."""
