"""How good it is: the protocol, baselines, the scoreboard, the paper's figures and claims."""

from sparsor.study.protocol import Split, SplitMaps, blocked_split, random_split, scaled, study_maps

__all__ = ["Split", "SplitMaps", "blocked_split", "random_split", "scaled", "study_maps"]
