import json
import subprocess
import sys
from pathlib import Path

PROJECT = Path(__file__).parents[1]


def test_the_benchmarks_run_and_tell_a_ratio_for_every_line(tmp_path: Path) -> None:
    """That they run, not how fast: a busy machine must not fail a test."""
    out = tmp_path / "out.json"
    short = ["--hours", "0.1", "--rounds", "1", "--json", str(out)]
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", *short],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    results = json.loads(out.read_text())
    assert len(results) == 5
    for result in results:
        assert result["ratio"] > 0
        assert result["work"] in done.stdout
