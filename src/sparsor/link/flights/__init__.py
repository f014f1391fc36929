"""Arming, starting and watching a flight."""
