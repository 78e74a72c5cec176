"""Whether a scene fits into the memory that is free."""

import psutil

from coupling.refused import Refused
from mpm.memory import estimated_bytes, estimated_elements
from mpm.scene import Scene as MpmScene


def check_memory(mpm_scene: MpmScene) -> None:
    """Refuse a scene whose mesh and points would not fit into the memory that is free."""
    free, need = free_memory_bytes(), estimated_bytes(mpm_scene)
    if need > 0.8 * free:
        raise Refused(
            f"discretisation: about {estimated_elements(mpm_scene):.2g} elements need about {need / 1e9:.1f} GB, "
            f"{free / 1e9:.1f} GB of memory are free; raise element_size, element_size_lining or size_growth"
        )


def free_memory_bytes() -> int:
    """Memory that a new process can use without swapping."""
    return psutil.virtual_memory().available
