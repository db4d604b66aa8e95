#pragma once
// How much of this process is in memory, as Linux tells it (proc(5)).

namespace plumb {

/// The most there ever was, in MiB; 0 where /proc is missing. getrusage() would count what the parent had when it
/// started this process.
double peak_resident_mib();

}  // namespace plumb
