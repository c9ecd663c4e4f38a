"""What both ends of the wire agree on: messages, keys, private folders, and events and faults in words."""
