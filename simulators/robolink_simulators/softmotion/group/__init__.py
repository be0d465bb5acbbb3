"""A simulated SoftMotion axis group as its function blocks show it."""
