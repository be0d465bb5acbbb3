"""What touches of a pin prove, beside the tip that they lead to."""
