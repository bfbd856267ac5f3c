"""Words that give a two-stage set the implicit method, at a rate that suits it."""

IMPLICIT = (
    "sensing=geared_line",
    "solver.backend=newmark",
    "solver.oversampling=12",
)
