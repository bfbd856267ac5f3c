"""Data sets on disk: schema, shards, manifest, splits, reading. Arrays and names, no physics."""
