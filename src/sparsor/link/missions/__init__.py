"""A plan onto the vehicle and back: the mission protocol, over good links and bad ones."""
