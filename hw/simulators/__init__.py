"""Simulated devices that speak as the real ones do, for tests and for trying a rig file without its rig."""
