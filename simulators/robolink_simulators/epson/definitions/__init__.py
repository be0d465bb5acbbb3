"""What a robot is told once and keeps: arches, added arms, limits and areas."""
