"""Poses in robot programs, with a grammar for each maker."""
