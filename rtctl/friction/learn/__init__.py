"""Points in, a model out: folds, machines, formulas, search, choice; and what is told of it (`report_*`):
evidence, tables, figures, page."""
