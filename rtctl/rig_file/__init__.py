"""The rig file: its tables, the devices it names, and how its mistakes are told."""
