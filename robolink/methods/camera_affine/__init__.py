"""camera-affine: an up-looking camera of unknown pose, found together with the tip."""
