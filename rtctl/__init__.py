"""Real-time control of haptic and motion rigs, with learned friction compensation."""

__version__ = "0.1.0"
