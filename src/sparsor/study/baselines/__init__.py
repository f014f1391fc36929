"""Other ways to choose where to measure, each giving an ordered route within a budget (method.md, Baselines)."""

from sparsor.study.baselines.algorithm1 import best_within
from sparsor.study.baselines.ipp import GaussianProcess, greedy_route, tuned_ipp
from sparsor.study.baselines.lawnmower import lawnmower
from sparsor.study.baselines.placement import qr_pivot_tour, random_tour

__all__ = [
    "GaussianProcess",
    "best_within",
    "greedy_route",
    "lawnmower",
    "qr_pivot_tour",
    "random_tour",
    "tuned_ipp",
]
