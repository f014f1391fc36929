"""The commands: each parses, calls a journey and prints."""
