"""Tips in a picture, each with why it was refused: docs/reference/eye.md, "The finder"."""

from robolink.eye.tip_finder.search import LEAST_RADIUS_PX, find_tips

__all__ = ["LEAST_RADIUS_PX", "find_tips"]
