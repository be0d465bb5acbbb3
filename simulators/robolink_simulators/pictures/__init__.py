"""Pictures as the up-looking camera of a simulated cell would take them, and who serves them."""
