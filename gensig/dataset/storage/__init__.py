"""Files of a data set: shards, their index, receipts, compression and checksums."""
