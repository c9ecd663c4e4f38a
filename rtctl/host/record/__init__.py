"""What the host keeps of a run: event log, incidents, recordings."""
