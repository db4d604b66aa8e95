#pragma once
// The report of a campaign: a table to read and rows to plot.

#include <iosfwd>
#include <vector>

#include "test/support/campaign/campaign.h"

namespace plumb::sim {

/// The flights of one scene with and without the range finder; an empty list is left out of the table.
struct SceneResult {
  std::string scene;
  std::vector<Run> range_vio;
  std::vector<Run> vio;
};

void print_table(std::ostream& out, const SceneResult& result);

void print_csv_header(std::ostream& out);
/// One row per flight.
void print_csv_rows(std::ostream& out, const SceneResult& result);

}  // namespace plumb::sim
