"""camera: a calibrated, up-looking camera sees the tip."""
