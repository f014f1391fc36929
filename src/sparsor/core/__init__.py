"""What every stage may use: atomic files, metrics, progress, random streams, workers."""
