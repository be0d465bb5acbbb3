"""Stopping before anything else, and what a stop leaves behind."""
