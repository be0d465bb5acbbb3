"""What the pytest fixtures bring; usable without pytest as well."""
