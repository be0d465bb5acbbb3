"""Asking a person: questions, lines, keys, jogging."""
