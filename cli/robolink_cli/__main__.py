"""``python -m robolink_cli`` does what ``robolink`` does."""

from robolink_cli.entry import main

main()
