#include "drivers/stim300/service_setup.h"

#include <array>
#include <string_view>

namespace plumb::stim300 {
namespace {

constexpr std::uint8_t kPrompt = '>';
// A prompt counts when nothing follows: datagrams, which may hold any byte, come at least every 8 ms.
constexpr Duration kQuiet = Duration::from_ms(30);
constexpr Duration kTimeout = Duration::from_ms(2000);

template <typename Table>
char code_of(const Table& table, int value) {
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (table[i] == value) return static_cast<char>('0' + i);
  }
  PLUMB_ASSERT(false && "usable settings have a code");
  return '?';
}

// Codes 0 to 7 without PPS, letters with it.
char content_code(const Settings& settings) {
  constexpr std::string_view kWithPps = "lmnpqrst";
  const unsigned code =
      (settings.accelerometer ? 1U : 0U) | (settings.inclinometer ? 2U : 0U) | (settings.temperatures ? 4U : 0U);
  return settings.pps ? kWithPps[code] : static_cast<char>('0' + code);
}

// 0 to 3, and the same delayed as 8, 9, a, b.
char gyro_unit_code(const Settings& settings) {
  constexpr std::string_view kDelayed = "89ab";
  const auto unit = static_cast<unsigned>(settings.gyro_unit);
  return settings.gyro_delayed ? kDelayed[unit] : static_cast<char>('0' + unit);
}

}  // namespace

ServiceSetup::Command ServiceSetup::command_for(Step step) const {
  Command command;
  const auto add = [&command](std::string_view text) {
    for (const char c : text) PLUMB_ASSERT(ok(command.push_back(static_cast<std::uint8_t>(c))));
  };
  const auto add_code = [&add](std::string_view text, char code, std::string_view rest = "") {
    add(text);
    add(std::string_view(&code, 1));
    add(rest);
  };
  switch (step) {
    case Step::kEnter: add("SERVICEMODE"); break;
    case Step::kRate: add_code("m ", code_of(kRates_hz, settings_.rate_hz)); break;
    case Step::kContent: add_code("d ", content_code(settings_), settings_.cr_lf ? ",1" : ",0"); break;
    case Step::kGyroUnit: add_code("u g,", gyro_unit_code(settings_)); break;
    case Step::kAccelUnit: add_code("u a,", static_cast<char>('0' + static_cast<int>(settings_.accel_unit))); break;
    case Step::kGyroFilter: add_code("f ", code_of(kFilters_hz, settings_.gyro_filter_hz), ",g"); break;
    case Step::kAccelFilter: add_code("f ", code_of(kFilters_hz, settings_.accel_filter_hz), ",a"); break;
    case Step::kSave: add("s"); break;
    case Step::kConfirm: add("Y"); break;
    case Step::kLeave: add("x N"); break;
    case Step::kDone: break;
  }
  add("\r");
  return command;
}

void ServiceSetup::receive(std::span<const std::uint8_t> bytes, Time now) {
  for (const std::uint8_t byte : bytes) {
    t_last_byte_ = now;
    prompt_seen_ = byte == kPrompt;
    if (step_ != Step::kEnter) look_for_error(byte);  // before, datagrams may still come
  }
}

// "E001 UNKNOWN COMMAND": an E and three digits, which no command has in it.
void ServiceSetup::look_for_error(std::uint8_t byte) {
  constexpr int kDigits = 3;
  if (byte == 'E') {
    error_digits_ = 0;
    error_number_ = 0;
  } else if (error_digits_ >= 0 && byte >= '0' && byte <= '9') {
    error_number_ = 10 * error_number_ + (byte - '0');
    ++error_digits_;
    if (error_digits_ == kDigits) {
      error_code_ = error_number_;
      status_ = Status::kRejected;
    }
  } else {
    error_digits_ = -1;
  }
}

ServiceSetup::Command ServiceSetup::poll(Time now) {
  if (status_ != Status::kNotReady) return {};
  if (waiting_) {
    // The question that follows the command to save need not be a prompt.
    const bool answered = (prompt_seen_ || step_ == Step::kSave) && t_last_byte_ > t_sent_;
    if (!answered || now - t_last_byte_ < kQuiet) {
      if (now - t_sent_ > kTimeout) status_ = Status::kStale;
      return {};
    }
    const bool skips_saving = step_ == Step::kAccelFilter && !save_;
    step_ = skips_saving ? Step::kLeave : static_cast<Step>(static_cast<int>(step_) + 1);
  }
  command_ = command_for(step_);
  waiting_ = true;
  prompt_seen_ = false;
  t_sent_ = now;
  if (step_ == Step::kLeave) {  // the unit is in Normal mode at once
    step_ = Step::kDone;
    status_ = Status::kOk;
  }
  return command_;
}

}  // namespace plumb::stim300
