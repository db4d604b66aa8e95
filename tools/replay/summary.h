#pragma once
// What a replay amounts to, as JSON for programs and as a short table for people.

#include <string>

#include "tools/replay/flight.h"
#include "tools/replay/hash_check.h"
#include "tools/replay/session.h"

namespace plumb::replay {

std::string summary_json(const Session& session, const FlightOptions& options, const FlightTotals& totals,
                         const HashCheck& hashes);
void print_summary(const Session& session, const FlightOptions& options, const FlightTotals& totals,
                   const HashCheck& hashes);

}  // namespace plumb::replay
