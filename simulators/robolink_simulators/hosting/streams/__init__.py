"""Hosts for byte streams: TCP ports and serial cables."""
