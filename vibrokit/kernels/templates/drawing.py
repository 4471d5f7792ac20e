"""Random numbers of all lanes."""

from numba import njit

from vibrokit.kernels.options import INNER_LANES
from vibrokit.kernels.registers import use_widest_registers
from vibrokit.kernels.streams import normal_pair

# --- scene above, stepper below ---


@njit(**INNER_LANES)
def draw_lanes(streams, normals, lanes):
    """Draw two standard normals for each lane, into two rows."""
    use_widest_registers()
    for lane in range(lanes):
        normals[lane], normals[lanes + lane] = normal_pair(streams, lane)
