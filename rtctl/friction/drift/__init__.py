"""Has friction changed since it was learned? Watched over ordinary motion, by whoever has ticks: host or reader of recordings."""
