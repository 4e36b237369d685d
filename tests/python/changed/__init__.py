"""Sound recordings, changed as a mistake in a robot cell would change them, and what `touchup doctor` says of each."""
