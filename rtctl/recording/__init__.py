"""What a rig leaves on disk: event log, incidents, recordings; and what is read back from them."""
