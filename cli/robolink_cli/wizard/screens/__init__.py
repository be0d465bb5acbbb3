"""What a state of the wizard looks like: pure functions from a state to lines of text."""
