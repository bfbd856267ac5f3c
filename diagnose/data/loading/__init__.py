"""Parts of the data sets for torch: items, transforms, streamed windows, replay, data module."""
