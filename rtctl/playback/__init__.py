"""`rtctl playback`: a recorded log through the real loop, and what compensation would have done to it."""
