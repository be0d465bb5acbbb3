"""What a face shows: plain records made from the state, for a terminal as for a page."""
