"""One pin that a person brings a tip onto: touches, what they prove, and the proof of a tip."""
