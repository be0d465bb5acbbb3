"""How the wizard is shown: a full screen, or one line after the other."""
