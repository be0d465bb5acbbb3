"""SPEL+ tasks: programs under way, side by side, in simulated time."""
