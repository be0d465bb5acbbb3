"""What surrounds a simulated robot: time, tips, pin, camera, board and the person. SIMULATED."""
