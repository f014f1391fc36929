"""The vehicle's own logs, fetched by the log protocol."""
