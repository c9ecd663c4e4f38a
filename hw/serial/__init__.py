"""Boards on a serial port: our own frame (`serial`) and frames described in the rig file
(`serial-described`)."""
