"""A rig that is not there: law and simulated joint as one loop, the family of joints, a recorded log in place
of a joint.
"""
