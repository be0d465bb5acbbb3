"""Solvers for marks that a camera sees."""
