"""The versions of Python and of packages that robolink was run with; ``make versions``."""
