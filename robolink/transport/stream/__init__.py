"""Byte streams: TCP connections and serial ports, and what is recorded of them."""
