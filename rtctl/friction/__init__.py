"""Friction models, offline: measured points in, a verified model file out. Where to look:

    points     friction as it was measured; point_reader, point_columns: its files; outliers, presliding:
               what is in it
    logs/      from a recording to friction samples and rigid-body parameters, and what is wrong with a log
    kind_*     what can be learned: one file per kind of curve (a new one: a file, a row); how it is compiled
    learn/     folds, machines, formulas, search, choice: from points to a model, and its report (`report_*`)
    model      the model in memory; artefact, document: its file, versioned, checksummed, verified on reading
    margins    what model and feed-forward leave of the device's passivity; what follows: gain, advice, ...

Reading a model (`artefact`, `model`, `kind_*`) needs NumPy and pydantic only."""
