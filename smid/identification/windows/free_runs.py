"""The samples that hold the ends where noise is on the outputs alone: from free runs (:mod:`.scan`)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.deadline import Progress
from smid.data import Dataset
from smid.identification.windows.scan import Scan, best_run
from smid.identification.windows.search import Held
from smid.identification.windows.whole_record import WholeRecord
from smid.models import Model

_BACK = (0.0, 1e-6, 1e-3)  # shares of the way to a run inside, tried until a run is verified


class FreeRuns:
    """Finds the extreme free runs within the noise bounds; fulfils :class:`~.search.Search`."""

    def __init__(
        self, model: Model, data: Dataset, bounds: Mapping[str, float], whole: WholeRecord, say: Progress
    ) -> None:
        self.model, self.data, self.bounds, self.whole, self._say = model, data, bounds, whole, say
        self._scan = Scan(model, data, bounds)

    def held(self, tolerance: float) -> Held:
        """Return what holds the ends."""
        scan = self._scan
        self._say(f"least error of a free run: {scan.least:.6f} times the noise bound")
        if scan.least >= 1.0:
            return Held(scan.places(scan.least_rows), scan.memory(tolerance), ())
        fitting, held, effects = [*self._verified(scan.inside)], [scan.least_rows], []
        for name in scan.free:
            ends = [scan.extreme(name, sign) for sign in (1, -1)]
            self._say(f"{name} between {ends[0].value:.6g} and {ends[1].value:.6g}, by linear programs")
            for end in ends:
                fitting += self._verified(end.vector)
                held.append(end.rows)
            effects.append(scan.difference(*ends))
        length = scan.memory(tolerance * min(effects, default=1.0))
        return Held(scan.places(np.unique(np.concatenate(held))), length, tuple(fitting))

    def near(
        self,
        values: Mapping[str, float],
        tolerance: float,  # noqa: ARG002  (the extreme runs are verified already)
    ) -> tuple[tuple[Array, ...], Index]:
        """Return the places most beyond the bound, from the initial states of the run inside."""
        return (), self._scan.places(self._scan.beyond(values))

    def fits(self, values: Mapping[str, float]) -> bool:
        """Return whether the best run with the parameters is verified."""
        best = best_run(self.model, self.data, self.bounds, values)
        return self.whole.holds(values, self.whole.noises(best), self.bounds)

    def _verified(self, vector: Array) -> list[Array]:
        """Return the parameters of a run, or of one nearer to the run inside, that are verified to fit all samples."""
        for share in _BACK:
            moved = vector + share * (self._scan.inside - vector)
            values = self._scan.values(moved)
            if self.whole.holds(values, self.whole.noises(self._scan.problem.simulate(moved)), self.bounds):
                return [np.array([values[p.name] for p in self.model.parameters])]
        return []
