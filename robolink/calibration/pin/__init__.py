"""Solvers for a tip that touches a pin."""
