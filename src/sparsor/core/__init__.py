"""What every stage may use: atomic files, progress, random streams, workers."""
