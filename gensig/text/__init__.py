"""Words and pages: nearest names, HTML pages, tables that users give, options as files."""
