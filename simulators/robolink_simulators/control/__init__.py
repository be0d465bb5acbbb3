"""The control API: what tests and pipelines in any language do to a simulated cell."""
