"""Friction as it was measured: points with every column they came with."""
