#include "tools/hil/player.h"

#include <algorithm>
#include <cstdio>

#include "hal/linux/linux_clock.h"
#include "tools/replay/progress_bar.h"

namespace plumb::hil {
namespace {

// How soon a request to stop is seen.
constexpr Duration kLongestSleep = Duration::from_ms(100);

/// False: told to stop.
bool wait_until(LinuxClock& clock, Time due, const std::atomic<bool>& stop) {
  for (Time now = clock.now(); now < due && !stop; now = clock.now())
    clock.wait_until(std::min(due, now + kLongestSleep));
  return !stop;
}

void put(Output& output, Account& account, const Said& said, Time due) {
  const Status status = output.put(said.message);
  if (status == Status::kInvalidValue) {
    ++account.invalid;
    return;
  }
  if (!ok(status)) {
    ++account.dropped;
    return;
  }
  const Duration lag = clock_now() - due;
  ++account.played;
  account.lag_sum = account.lag_sum + lag;
  account.lag_most = std::max(account.lag_most, lag);
}

std::string progress_text(const PlayReport& report, Duration whole) {
  Duration lag;
  std::uint64_t dropped = 0;
  for (const Account& account : report.accounts) {
    lag = std::max(lag, account.lag_most);
    dropped += account.dropped;
  }
  char text[96];
  std::snprintf(text, sizeof text, "%.1f of %.1f s, lag at most %.1f ms, dropped %llu", report.recorded.seconds(),
                whole.seconds(), 1e3 * lag.seconds(), static_cast<unsigned long long>(dropped));
  return text;
}

}  // namespace

Duration Account::lag_mean() const { return played == 0 ? Duration() : lag_sum / static_cast<std::int64_t>(played); }

PlayReport play(const std::string& file, const Contents& contents, const std::vector<std::unique_ptr<Output>>& outputs,
                double rate, const std::atomic<bool>& stop) {
  Recording recording(file);
  PlayReport report;
  report.accounts.resize(outputs.size());
  LinuxClock clock;
  ProgressBar bar;
  const Time start = clock.now();
  const Duration whole = contents.last - contents.first;
  for (Said said; recording.next(said);) {
    const Duration since = said.t - contents.first;
    const Time due = start + Duration::from_seconds(since.seconds() / rate);
    report.interrupted = !wait_until(clock, due, stop);
    if (report.interrupted) break;
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      if (said.channel == outputs[i]->channel()) put(*outputs[i], report.accounts[i], said, due);
    }
    report.recorded = since;
    bar.show(whole > Duration() ? since.seconds() / whole.seconds() : 1.0, progress_text(report, whole));
  }
  report.taken = clock.now() - start;
  return report;
}

}  // namespace plumb::hil
