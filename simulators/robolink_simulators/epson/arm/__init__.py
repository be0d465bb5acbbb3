"""The arm of a simulated EPSON robot: models, kinematics, speeds and paths."""
