"""Virtual environments behind the coupling: a file for each kind, and one table that all who know kinds read.

`table` lists the kinds; `kind` says what a kind's file holds. `laws` is the compiled code of the table,
`coupling` what is felt of it at the joint, `changes` and `targets` how the environment in force follows what
programs ask."""
