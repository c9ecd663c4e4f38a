"""The experiments of both papers, as evidence: the same task with and without compensation, in one report.

One file per experiment; `registry` names them. Shared: `order` (what is asked), `statistics`, `report`
(parts of a page), `figures` (pictures), `virtual` (the simulated rig), `models` (friction models compared).
"""
