"""How a controller is reached, what it can, and what others left there."""
