"""What the host tells: samples, events, faults with where they come from, health."""
