"""How much the study does: the full one, and the quick one that only shows that all is there."""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class StudySettings:
    """What decides every figure of the study beside the field.

    Parameters
    ----------
    name : str
    shares : tuple of float
        Path lengths, of full coverage.
    folds, seeds : tuple of int
        Folds of the `blocked`, seeds of the `random` protocol on the scoreboard.
    noises : tuple of float
        Standard deviations of a reading, on the 0..1 scale.
    seed : int
        Of everything drawn.
    moves : int
        Of the refined search.
    samples : int
        Of Algorithm 1 on the scoreboard.
    atoms, paper_atoms : int
        K, by default and as the paper has it.
    rows : int
        M.
    lasso_maps : int
        Most test maps that the LASSO decodes, evenly chosen: it takes as long as all linear decoders together.
    probabilities : tuple of float
        Of the figure of error against path length.
    trials : tuple of int
        Its seeds.
    draws, sweep_draws : int
        n_iter of the paper's figures, each trial: against path length, and of the lambdas.
    peer_steps : int
        Of SGP-Tools' optimiser, where it runs.
    weights : tuple of float
        Values of lambda_path and lambda_incoh, in units that make their terms as large as the error's at the typical
        sample.
    """

    name: str
    shares: tuple[float, ...] = (0.05, 0.10, 0.20, 0.30)
    folds: tuple[int, ...] = (0, 1, 2)
    seeds: tuple[int, ...] = (0, 1, 2)
    noises: tuple[float, ...] = (0.0, 0.01)
    seed: int = 0
    moves: int = 160_000
    samples: int = 400
    atoms: int = 256
    paper_atoms: int = 1024
    rows: int = 35
    lasso_maps: int = 64
    probabilities: tuple[float, ...] = (0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.09, 0.10, 0.11, 0.12)
    trials: tuple[int, ...] = (0, 1, 2)
    draws: int = 20
    sweep_draws: int = 200
    peer_steps: int = 100
    weights: tuple[float, ...] = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)

    def of(self, *names: str) -> dict[str, object]:
        """Return some of the settings, for the key of what they decide."""
        known = {one.name for one in fields(self)}
        return {name: getattr(self, name) for name in names if name in known}


FULL = StudySettings("full")
QUICK = StudySettings(
    "quick",
    shares=(0.10, 0.20),
    folds=(0,),
    seeds=(0,),
    noises=(0.0, 0.01),
    moves=4_000,
    samples=40,
    atoms=48,
    paper_atoms=96,
    lasso_maps=16,
    probabilities=(0.03, 0.06, 0.12),
    trials=(0, 1, 2),
    draws=4,
    sweep_draws=24,
    peer_steps=10,
    weights=(0.0, 0.3, 1.0, 3.0, 30.0),
)
