"""Random numbers of all lanes."""

from numba import njit

from vibrokit.kernels.options import INNER_LANES
from vibrokit.kernels.registers import use_widest_registers
from vibrokit.kernels.streams import normal_pair
from vibrokit.kernels.templates.scene import LANES

# --- scene above, stepper below ---


@njit(**INNER_LANES)
def draw_lanes(streams, normals):
    """Draw two standard normals for each lane, into two rows."""
    use_widest_registers()
    for lane in range(LANES):
        normals[lane], normals[LANES + lane] = normal_pair(streams, lane)
