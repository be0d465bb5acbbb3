"""The guided dialogue at a terminal: one flow, drawn on a full screen or told line by line."""
