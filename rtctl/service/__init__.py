"""The rig as a systemd service: what is installed where, and by which commands."""
