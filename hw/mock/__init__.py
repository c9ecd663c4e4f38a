"""Simulated rig: DC motor, gearbox, friction, sensors and a scripted hand, with the truth at hand."""
