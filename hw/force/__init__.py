"""Force sensors that speak for themselves: Bota Rokubi and OptoForce on a serial port, RDT over UDP."""
