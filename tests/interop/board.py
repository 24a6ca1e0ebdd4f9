"""Reads what `hilt export tensorboard` writes with Python's tensorboard: every number of the tables, in single precision, and what it is.

Usage: board.py HILT TABLE.parquet... Exits 1 at the first thing that is not as promised.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

PLACE = {"stage", "epoch", "updates"}


def check(holds, what):
    if not holds:
        sys.exit(f"FAILED: {what}")


def compare(path, board):
    table = pq.read_table(path)
    read = EventAccumulator(str(board), size_guidance={"scalars": 0})
    read.Reload()
    tags, compared = set(read.Tags()["scalars"]), 0
    for field in table.schema:
        if field.name in PLACE:
            continue
        values = np.asarray(table[field.name], dtype=np.float64)
        known = np.flatnonzero(np.isfinite(values))
        check((field.name in tags) == (len(known) > 0), f"{path}: tag {field.name}")
        if len(known) == 0:
            continue
        events = read.Scalars(field.name)
        check([event.step for event in events] == list(known + 1), f"{path}: steps of {field.name}")
        found = np.array([event.value for event in events], dtype=np.float32)
        check(np.array_equal(found, values[known].astype(np.float32)), f"{path}: values of {field.name}")
        compared += len(known)
        tags.discard(field.name)
    check(not tags, f"{path}: further tags {tags}")
    check(compared > 0, f"{path}: nothing to compare")
    print(f"{path}: {compared} numbers of {len(table)} epochs, as tensorboard reads them")


def main():
    hilt, tables = sys.argv[1], sys.argv[2:]
    for table in tables:
        with tempfile.TemporaryDirectory() as out:
            subprocess.run([hilt, "--quiet", "export", "tensorboard", table, "--out", f"{out}/board"], check=True)
            boards = list(Path(out, "board").iterdir())
            check(len(boards) == 1, f"{table}: directories {boards}")
            compare(table, boards[0])


main()
