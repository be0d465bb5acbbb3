"""Sans-IO codecs: bytes to events and back, for both ends of the line. No clock, no sockets."""
