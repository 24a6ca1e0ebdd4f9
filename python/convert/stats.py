"""The statistics that LeRobot keeps of every column: of each episode, and of the whole dataset."""

import numpy as np

QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
SKETCH_ROWS = 8192  # of each block from which the quantiles of a whole dataset are read


def statistics(values):
    """LeRobot's statistics of the rows of a column, of one episode."""
    values = np.atleast_2d(np.asarray(values, np.float64).reshape(len(values), -1))
    found = {"min": values.min(0), "max": values.max(0), "mean": values.mean(0), "std": values.std(0)}
    found |= {name: np.quantile(values, q, axis=0) for name, q in QUANTILES.items()}
    return {name: value.tolist() for name, value in found.items()} | {"count": [len(values)]}


class Running:
    """LeRobot's statistics of rows that come in parts, of a whole dataset, in bounded memory.

    Mean and variance are put together from those of the parts (Chan et al.), in float64. Quantiles come from blocks of sorted entries: when two
    blocks stand for the same number of rows, one of every two of their entries is kept for both, the first and the second by turns (Munro and Paterson).
    Exact below 2 SKETCH_ROWS rows; beyond, the rank of a quantile is off by at most (1 + log2(rows / SKETCH_ROWS)) / (2 SKETCH_ROWS) of the rows: .11 %
    of 10^9.
    """

    def __init__(self, width):
        self.count, self.mean, self.squares = 0, np.zeros(width), np.zeros(width)
        self.low, self.high = np.full(width, np.inf), np.full(width, -np.inf)
        self.loose, self.waiting = np.empty((SKETCH_ROWS, width)), 0  # rows that are in no block yet, and how many
        self.blocks, self.second = [], []  # blocks[i], if there is one, stands for 2^i rows an entry; which of two entries it keeps next

    def add(self, values):
        values = np.asarray(values, np.float64)
        more, mean, total = len(values), values.mean(0), self.count + len(values)
        off = mean - self.mean
        self.squares += np.square(values - mean).sum(0) + np.square(off) * (self.count * more / total)
        self.mean += off * (more / total)
        self.count, self.low, self.high = total, np.minimum(self.low, values.min(0)), np.maximum(self.high, values.max(0))
        while len(values):
            taken = values[: SKETCH_ROWS - self.waiting]
            self.loose[self.waiting : self.waiting + len(taken)] = taken
            values, self.waiting = values[len(taken) :], self.waiting + len(taken)
            if self.waiting == SKETCH_ROWS:
                self._keep(np.sort(self.loose, axis=0))
                self.waiting = 0

    def _keep(self, block):
        for level, other in enumerate(self.blocks):
            if other is None:
                self.blocks[level] = block
                return
            block = np.sort(np.concatenate([other, block]), axis=0)[self.second[level] :: 2]
            self.blocks[level], self.second[level] = None, 1 - self.second[level]
        self.blocks.append(block)
        self.second.append(0)

    def _quantiles(self):
        parts = [(self.loose[: self.waiting], 1), *((block, 2**level) for level, block in enumerate(self.blocks) if block is not None)]
        values = np.concatenate([part for part, _ in parts])
        weights = np.concatenate([np.full(len(part), weight) for part, weight in parts])
        order = np.argsort(values, axis=0)
        places = np.array(list(QUANTILES.values())) * (self.count - 1)
        found = []
        for entry, ranked in enumerate(order.T):
            of = weights[ranked]
            middle = np.cumsum(of) - (of + 1) / 2  # of the ranks that each stands for
            found.append(np.interp(places, middle, values[ranked, entry]))
        return dict(zip(QUANTILES, np.transpose(found)))

    def found(self):
        found = {"min": self.low, "max": self.high, "mean": self.mean, "std": np.sqrt(self.squares / self.count), **self._quantiles()}
        return {name: value.tolist() for name, value in found.items()} | {"count": [self.count]}
