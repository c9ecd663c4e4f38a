"""What can be learned of friction: one file per kind of curve, and their compilation."""
