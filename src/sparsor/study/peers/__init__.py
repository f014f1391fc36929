"""Planners by others, SGP-Tools and PySensors, run through their own interfaces where a Python has them."""

from sparsor.study.peers.routes import PeerRoute, Peers, best_kind, find_peers, own_python, peer_routes

__all__ = ["PeerRoute", "Peers", "best_kind", "find_peers", "own_python", "peer_routes"]
