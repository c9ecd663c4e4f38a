"""What was held out of one candidate, and what candidates are compared by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.friction.learn.certainty import doubt, less_shared, standard_error
from rtctl.friction.learn.machines import Candidate


@dataclass(frozen=True)
class Score:
    """Held-out errors (N m) of one candidate on one side; `failed` says why there are none.

    `n_terms` is the number of support vectors, or parameters, trained on all points (before the last round of
    halving: mean over the folds)."""

    candidate: Candidate
    direction: int
    errors: np.ndarray
    n_terms: float
    failed: str | None = None
    converged: bool = True
    blocks: np.ndarray | None = None
    """Block of each error, as of `Side`; None: each is its own."""
    between: np.ndarray | None = None
    """Errors with whole speeds held out of all sessions, of `Side.between`, N m; None where there are
    none."""
    between_blocks: np.ndarray | None = None
    """Block of each of `between`."""

    @property
    def compared(self) -> np.ndarray:
        """Errors that candidates are compared by, N m: those held out; of sessions at the same speeds those
        of sessions and of speeds held out, one after the other, less what the sessions differ by."""
        # one kind of hold-out: what sessions differ by cannot be told from friction, and stays in
        if self.between is None or self.blocks is None or self.between_blocks is None:
            return self.errors
        known = (self.errors, self.blocks), (self.between, self.between_blocks)
        return np.concatenate([less_shared(*one) for one in known])

    @property
    def compared_blocks(self) -> np.ndarray | None:
        """Block of each of `compared`."""
        if self.between_blocks is None or self.blocks is None:
            return self.blocks
        return np.concatenate([self.blocks, self.between_blocks])

    @property
    def compared_nm(self) -> float:
        """Root mean square of `compared`; infinite when the candidate failed."""
        # infinite and not NaN: a minimum over candidates passes it by
        return float("inf") if self.failed else float(np.sqrt(np.mean(self.compared**2)))

    @property
    def rmse_nm(self) -> float:
        """Root mean square of the held-out errors; infinite when the candidate failed."""
        return float("inf") if self.failed else float(np.sqrt(np.mean(self.errors**2)))

    @property
    def se_nm(self) -> float:
        """Standard error of `rmse_nm`."""
        return standard_error(self.errors, self.blocks)

    @property
    def doubt_nm(self) -> float:
        """See `certainty.doubt`, N m."""
        return doubt(self.compared, self.compared_blocks)
