"""The plan of a data set: every input of every record, drawn before anything runs."""
