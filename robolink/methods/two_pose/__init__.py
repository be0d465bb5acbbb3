"""two-pose: one pin touched at two angles of U."""
