"""One record: its inputs from a row of the plan, its simulation, its arrays and values."""
