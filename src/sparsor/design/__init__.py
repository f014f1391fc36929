"""Where to sample: the measurement matrix, the LASSO, routes, Algorithm 1."""

from sparsor.design.budget import Budget, BudgetRequest, parse_budget
from sparsor.design.lars import lasso
from sparsor.design.legs import LegTable, unit_legs
from sparsor.design.monte_carlo import evaluate, fixed_sparsity, search
from sparsor.design.problem import Candidate, Problem, Weights
from sparsor.design.route import shortest_path
from sparsor.design.sparsity import searched_sparsity

__all__ = [
    "Budget",
    "BudgetRequest",
    "Candidate",
    "LegTable",
    "Problem",
    "Weights",
    "evaluate",
    "fixed_sparsity",
    "lasso",
    "parse_budget",
    "search",
    "searched_sparsity",
    "shortest_path",
    "unit_legs",
]
