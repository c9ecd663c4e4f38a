"""A rig that is not there: law and simulated joint as one loop, the family of joints, what is measured of a
joint (`mock_points`) against what is true of it (`friction_truth`), a recorded log in place of a joint
(`playback_*`).

`campaign_*` is safety by volume: random rigs, faults and commands in the compiled law, watched by an oracle
of its own."""
