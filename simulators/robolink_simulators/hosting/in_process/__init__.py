"""Simulators that live in this process and are shared by name."""
