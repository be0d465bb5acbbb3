"""points: poses that exist already, taught on the pendant, typed or kept in a file."""
