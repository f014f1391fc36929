"""How good it is: the protocol, and later baselines and figures."""

from sparsor.study.protocol import Split, SplitMaps, blocked_split, random_split, scaled, study_maps

__all__ = ["Split", "SplitMaps", "blocked_split", "random_split", "scaled", "study_maps"]
