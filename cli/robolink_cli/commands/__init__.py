"""The commands, grouped by what a person is about to do."""
