#pragma once
// Faults of the range finders, one row each: on CAN, and a LIDAR-Lite.

#include <vector>

#include "test/faults/fault_table.h"

namespace plumb::faults {

void add_range_faults(std::vector<Fault>& rows);
void add_lidar_lite_faults(std::vector<Fault>& rows);

}  // namespace plumb::faults
