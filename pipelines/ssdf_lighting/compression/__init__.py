"""Distance functions made small: as a file and in memory."""
