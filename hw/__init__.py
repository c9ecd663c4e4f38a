"""Device backends: the mock rig, recorded playback, and (later) serial and CAN devices.

This package imports nothing of `rtctl`: a backend fills and reads fields of the tick
record it is handed, by name, and can be tested alone."""
