"""The verb new: a gearbox from its data sheet."""
