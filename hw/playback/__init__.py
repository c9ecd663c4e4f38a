"""Playback: a recorded log becomes the sensor stream of the real loop."""
