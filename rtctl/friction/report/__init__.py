"""The report of a fit: evidence, tables, figures, page."""
