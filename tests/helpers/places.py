"""Where tests find the project's files and the real recordings."""

from pathlib import Path

PROJECT = Path(__file__).parents[2]
SAMPLE_DATA = PROJECT / "sample_data"
LAYOUTS = SAMPLE_DATA / "layouts"
RECORDINGS = PROJECT.parent / "shared" / "data"
KVLCC2 = RECORDINGS / "kvlcc2"
HOSTILE_CASES = PROJECT.parent / "shared" / "cases" / "24-hostile-and-damaged"
