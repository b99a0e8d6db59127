"""Content of .rrd files, read back by Rerun."""

from pathlib import Path
from typing import Any

from rerun.chunk import RrdReader


def static_components(path: Path, component: str) -> dict[str, list[Any]]:
    """Return a component of each entity that has it, by the entity's path."""
    found = {}
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        if chunk.is_static and component in batch.schema.names:
            found[chunk.entity_path] = list(batch[component].to_pylist()[0] or ())
    return found


def view_titles(path: Path) -> list[str]:
    """Return the titles of the views of the blueprint in the file."""
    reader, name = RrdReader(path), "ViewBlueprint:display_name"
    batches = (c.to_record_batch() for c in reader.stream(store=reader.blueprints()[0]))
    return [row[0] for b in batches if name in b.schema.names for row in b[name].to_pylist()]
