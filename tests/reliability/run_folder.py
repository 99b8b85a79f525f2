"""What must hold of a run folder at any moment, also after a kill or a failing disk."""

import hashlib
import json
from pathlib import Path

import numpy as np


def check_run_folder(folder: Path) -> int:
    """Assert that every visible file is whole and every listed frame is there; return how many frames are listed."""
    if not folder.exists():
        return 0
    for path in (folder / "frames").glob("[!.]*"):
        with np.load(path, allow_pickle=False) as arrays:
            assert all(np.isfinite(arrays[name]).all() for name in arrays.files), path
    if (folder / "scene.yaml").exists():
        from warpsim import load_scene

        load_scene(folder / "scene.yaml")
    index = folder / "frames.jsonl"
    text = index.read_text() if index.exists() else ""
    assert text.endswith("\n") or not text
    chain = ""
    for k, line in enumerate(text.splitlines()):
        entry = json.loads(line)
        data = (folder / entry["file"]).read_bytes()
        chain = hashlib.sha256((chain + entry["state"]).encode()).hexdigest()
        assert entry["index"] == k and entry["chain"] == chain and entry["sha256"] == hashlib.sha256(data).hexdigest()
    table = folder / "stats.csv"
    rows = table.read_text() if table.exists() else ""
    assert rows.endswith("\n") or not rows
    assert len({row.count(",") for row in rows.splitlines()}) <= 1
    changes = folder / "changes.jsonl"
    if changes.exists():
        assert changes.read_bytes()[-1:] in (b"", b"\n")
        assert all({"index", "path", "value"} == json.loads(line).keys() for line in changes.read_text().splitlines())
    log = folder / "log.txt"
    assert not log.exists() or log.read_bytes()[-1:] in (b"", b"\n")
    return len(text.splitlines())
