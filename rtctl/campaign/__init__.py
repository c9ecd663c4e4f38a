"""Safety by volume: random rigs, faults and commands in the compiled law, watched by an oracle of its own."""
