"""The guided dialogue at a terminal: one flow, on a full screen or line by line."""
