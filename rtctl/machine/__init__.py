"""What rtctl needs of this machine: `rtctl doctor`, `rtctl probe`, and the systemd service."""
