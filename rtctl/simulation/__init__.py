"""A rig that is not there: the law and the simulated joint as one loop, the family of joints, the demonstration."""
