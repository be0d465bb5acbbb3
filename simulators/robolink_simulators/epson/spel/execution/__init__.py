"""How statements are carried out in simulated time."""
