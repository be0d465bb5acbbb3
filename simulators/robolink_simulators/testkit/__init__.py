"""The parts of the pytest fixtures; usable without pytest as well."""
