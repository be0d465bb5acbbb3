"""Movements of a simulated axis group: planned, queued, jogged, followed in time."""
