"""What is proved of the law before it runs: pure functions of numbers, asked by `rtctl check`, by campaigns
and experiments.

`stability` has the conditions of the coupling (`sampled_loop` behind delay and lag, `held_samples` of slow
sensors, `delay_cover` of a delay that grows while it runs), `friction_passivity` those of the feed-forward.
`observer_margin` and `admittance_margin` judge the eigenvalues of `observer_loop` and `admittance_loop` with
a hand on the drive (`drive_in_hand`), and `admittance_proof` what lies between the points of a grid
(`admittance_spectrum`, `discs`). Proofs know the law's own formulas; the law knows none of these."""
