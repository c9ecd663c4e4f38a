"""A rig that is not there: law and simulated joint as one loop, the family of joints, the demonstration, a recorded log in place of a joint."""
