"""Routes that minimise the error to expect of the map, searched directly."""
