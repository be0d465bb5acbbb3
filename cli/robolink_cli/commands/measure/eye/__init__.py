"""eye look, eye collect: what robolink's own finder sees in a picture. Nothing moves."""

from robolink_cli.commands.measure.eye.command import eye

__all__ = ["eye"]
