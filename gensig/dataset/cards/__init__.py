"""The data card of a data set: README.md, croissant.json and class figures."""
