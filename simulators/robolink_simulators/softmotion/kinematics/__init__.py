"""Kinematics of simulated SoftMotion machines: frames, coordinates, positions, orientations."""
