"""board: a held board, by its fiducials before an up-looking camera."""
