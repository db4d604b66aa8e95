"""Prints the transfers of a flight's ranges with a LIDAR-Lite v3, as the simulator records them, one a line:

`range TIME_NS RANGE_M` before the transfers of each range, then `read|write TIME_NS HEX` for each transfer.
"""

import numpy as np
from plumb_tools.sim.devices.lidar_lite import LidarLiteSettings, measurement, set_up

SETTINGS = LidarLiteSettings()
RANGES_M = np.concatenate([np.linspace(0.05, 40.0, 97), [0.0, 40.01, 12.34]])
PERIOD_NS = 40_000_000


def show(transfers) -> None:
    """One line per transfer."""
    for transfer in transfers:
        print("read" if transfer.is_read else "write", transfer.time_ns, transfer.data.hex())


show(set_up(90_000_000, SETTINGS))
for i, range_m in enumerate(RANGES_M.tolist()):
    t_ns = 100_000_000 + i * PERIOD_NS
    print("range", t_ns, repr(range_m))
    show(measurement(t_ns, range_m, SETTINGS.acquisition_ns, SETTINGS))
