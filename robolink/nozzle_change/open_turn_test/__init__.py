"""The turn test of a change that was cut off between its write and its proof."""
