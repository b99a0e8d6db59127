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
    return _blueprint_names(path, "ViewBlueprint:display_name")


def tab_names(path: Path) -> list[str]:
    """Return the names of the containers of the blueprint in the file."""
    return _blueprint_names(path, "ContainerBlueprint:display_name")


def _blueprint_names(path: Path, component: str) -> list[str]:
    reader = RrdReader(path)
    batches = (c.to_record_batch() for c in reader.stream(store=reader.blueprints()[0]))
    found = (b[component].to_pylist() for b in batches if component in b.schema.names)
    return [row[0] for rows in found for row in rows]
