"""The plan of the tests: 40 machines of 10 sets of gears in 4 gearboxes, faults as given."""

CROSSED = (
    "plan.n_units=40",
    "plan.n_gearboxes=4",
    "plan.machines=crossed",
    "plan.fault_gear=as_given",
    "plan.n_reference=0",
)
