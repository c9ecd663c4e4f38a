"""What `rtctl check` proves of a rig file, and the arrays of the law that are made of a file that passed."""
