"""Writes a LeRobotDataset v3.0 from arrays: the one writer behind the converters beside it. Needs numpy and pyarrow.

An episode is a dict of column names to arrays of T rows: `observation.state`, `action`, and what else there is (`next.reward`, `next.done`,
`next.success`). Rows stream to the disk episode by episode: memory holds one of them, what is said of each, and running statistics. The dataset
takes its place when it is whole.
"""

import json
import os
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from stats import Running, statistics

DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
FILE_BYTES = 100_000_000  # LeRobot's own size of a data file


class Refused(Exception):
    """What is wrong with the input, in words."""


def as_column(name, values):
    """float32, int64 or bool, at most one number list a row."""
    values = np.asarray(values)
    if values.dtype == bool:
        kind = bool
    elif np.issubdtype(values.dtype, np.integer):
        kind = np.int64
    elif np.issubdtype(values.dtype, np.floating):
        kind = np.float32
    else:
        raise Refused(f"column {name} holds {values.dtype}; numbers are needed")
    values = values.astype(kind).reshape(len(values), -1)
    if kind is np.float32 and not np.isfinite(values).all():
        raise Refused(f"column {name}, row {int(np.argwhere(~np.isfinite(values))[0][0])} of its episode: not a finite number")
    return values


def to_arrow(values):
    flat = pa.array(np.ascontiguousarray(values).reshape(-1))
    return flat if values.shape[1] == 1 else pa.FixedSizeListArray.from_arrays(flat, values.shape[1])


def write(root, episodes, fps, *, robot_type=None, names=None):
    """Writes `episodes`, pairs of a task's words and its columns, to `root`, which must not exist. `names` has the entries of columns."""
    root, names = Path(root), names or {}
    if root.exists():
        raise Refused(f"{root} exists; choose another place")
    root.parent.mkdir(parents=True, exist_ok=True)
    made = Path(tempfile.mkdtemp(prefix=f".{root.name}.", dir=root.parent))
    try:
        _fill(made, episodes, fps, robot_type, names)
        made.chmod(0o755)
        os.rename(made, root)
    except BaseException:
        shutil.rmtree(made, ignore_errors=True)
        raise


def _fill(root, episodes, fps, robot_type, names):
    tasks, table, shapes, running, first, file, writer = {}, [], None, {}, 0, 0, None
    for number, (task, columns) in enumerate(episodes):
        columns = {name: as_column(name, values) for name, values in columns.items()}
        lengths = {name: len(values) for name, values in columns.items()}
        if len(set(lengths.values())) != 1 or not min(lengths.values()):
            raise Refused(f"episode {number}: columns of {lengths} rows; the same number is needed, at least 1")
        length, place = next(iter(lengths.values())), tasks.setdefault(task, len(tasks))
        frames = np.arange(length, dtype=np.int64)
        columns |= {
            "timestamp": as_column("timestamp", (frames / fps).astype(np.float32)),
            "frame_index": frames[:, None],
            "episode_index": np.full((length, 1), number, np.int64),
            "index": (first + frames)[:, None],
            "task_index": np.full((length, 1), place, np.int64),
        }
        found = {name: (values.dtype, values.shape[1]) for name, values in columns.items()}
        if shapes is not None and found != shapes:
            odd = sorted({name for name in found.keys() | shapes.keys() if found.get(name) != shapes.get(name)})
            raise Refused(f"episode {number} has other columns than the first: {', '.join(odd)}")
        shapes = found
        arrow = pa.table({name: to_arrow(values) for name, values in columns.items()})
        path = root / DATA_PATH.format(chunk_index=file // 1000, file_index=file % 1000)
        if writer is None:
            path.parent.mkdir(parents=True, exist_ok=True)
            writer = pq.ParquetWriter(path, arrow.schema)
        writer.write_table(arrow, row_group_size=length)
        row = {"episode_index": number, "tasks": [task], "length": length, "data/chunk_index": file // 1000, "data/file_index": file % 1000}
        row |= {"dataset_from_index": first, "dataset_to_index": first + length, "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}
        for name, values in columns.items():
            if name not in running:
                running[name] = Running(values.shape[1])
            running[name].add(values)
            row |= {f"stats/{name}/{key}": value for key, value in statistics(values).items()}
        table.append(row)
        first += length
        if path.stat().st_size >= FILE_BYTES:
            writer.close()
            writer, file = None, file + 1
    if writer is not None:
        writer.close()
    if not table:
        raise Refused("no episode was found")
    stats = {name: of.found() for name, of in running.items()}
    _describe(root, table, tasks, shapes, stats, first, fps, robot_type, names)


def _describe(root, table, tasks, shapes, stats, frames, fps, robot_type, names):
    path = root / "meta/episodes/chunk-000/file-000.parquet"
    path.parent.mkdir(parents=True)
    pq.write_table(pa.Table.from_pylist(table), path)
    words = pa.table({"task_index": pa.array(range(len(tasks)), pa.int64()), "task": pa.array(list(tasks))})
    # LeRobot looks tasks up in the pandas index.
    column = lambda name, kind, numpy: {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": numpy, "metadata": None}
    index = {"name": None, "field_name": None, "pandas_type": "unicode", "numpy_type": "object", "metadata": {"encoding": "UTF-8"}}
    columns = [column("task_index", "int64", "int64"), column("task", "unicode", "object")]
    pandas = {"index_columns": ["task"], "column_indexes": [index], "columns": columns, "pandas_version": "2.2.3"}
    pq.write_table(words.replace_schema_metadata({"pandas": json.dumps(pandas)}), root / "meta/tasks.parquet")
    (root / "meta/stats.json").write_text(json.dumps(stats, indent=2) + "\n")
    dtype = lambda kind: {"bool": "bool", "int64": "int64", "float32": "float32"}[str(kind)]
    features = {name: {"dtype": dtype(kind), "shape": [width], "names": names.get(name)} for name, (kind, width) in shapes.items()}
    info = {
        "codebase_version": "v3.0",
        "robot_type": robot_type,
        "total_episodes": len(table),
        "total_frames": frames,
        "total_tasks": len(tasks),
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": int(fps) if fps == int(fps) else fps,
        "splits": {"train": f"0:{len(table)}"},
        "data_path": DATA_PATH,
        "video_path": None,
        "features": features,
    }
    (root / "meta/info.json").write_text(json.dumps(info, indent=2) + "\n")


def run(convert):
    """Runs a converter's `main`; what it refuses becomes one line and exit code 1."""
    try:
        convert()
    except (Refused, OSError) as why:
        sys.exit(f"error: {why}")
