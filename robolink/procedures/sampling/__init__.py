"""Samples of one measurement: how a method takes them, and when they are enough."""
