"""The report of a study: page, tables and figures."""
