"""A distribution of adapters in a folder, as an install leaves it: its metadata and its entry points, no more."""

from collections.abc import Mapping
from importlib import invalidate_caches
from pathlib import Path

from carom.engines import registry
from carom.engines.registry import ENTRY_POINT_GROUP
from carom.execution import cache_key


def write_distribution(site: Path, name: str, points: Mapping[str, str], version: str = "1.0") -> None:
    """Write the metadata of a distribution; `points` holds "module:attribute" by the name of the entry point."""
    info = site / f"{name.lower().replace('-', '_')}-{version}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    lines = "".join(f"{point} = {value}\n" for point, value in points.items())
    (info / "entry_points.txt").write_text(f"[{ENTRY_POINT_GROUP}]\n{lines}")


def clear_entry_point_caches() -> None:
    """Clear the caches of entry points and versions."""
    invalidate_caches()
    registry.list_adapter_points.cache_clear()
    cache_key.find_versions.cache_clear()
