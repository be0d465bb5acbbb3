"""Ways of the arm that are more than one plain leg."""
