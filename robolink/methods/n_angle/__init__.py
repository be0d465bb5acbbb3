"""n-angle: one pin touched at several angles of U, each checked by the others."""
