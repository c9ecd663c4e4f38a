"""Friction identification on the rig: plan, motions, measurements, data set.

The procedure (`session.identify`) is one generator. It yields an `Order` and receives the ticks that
followed; whoever drives it decides where those come from: `experiments.simulated_identification.drive` (the
compiled simulation) or `observer.Identifier` (the host of the real loop). Nothing in between knows which."""
