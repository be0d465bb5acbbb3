"""What a robot's drives give: estimated torques, what is measured of them, what stops them."""
