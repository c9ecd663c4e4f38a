"""Points in, a model out: folds, machines, formulas, search, choice."""
