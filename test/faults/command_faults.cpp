#include "test/faults/command_faults.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>

#include "fsw/app/parameters.h"
#include "fsw/base/crc32.h"
#include "fsw/telemetry/lcm_codec.h"
#include "plumb_lcm/plumb/command_t.hpp"
#include "test/support/param_store_seam.h"

namespace plumb::faults {
namespace {

/// A command_t as tools/command sends it; with a checksum that does not fit when `damaged`.
void send(World& world, int sequence, int id, const std::array<double, kCommandArguments>& arguments = {},
          bool damaged = false) {
  command_t message{};
  message.source = 7;
  message.sequence = sequence;
  message.id = static_cast<std::int16_t>(id);
  std::copy(arguments.begin(), arguments.end(), std::begin(message.arguments));
  std::array<std::uint8_t, 128> bytes{};
  const std::size_t size = write(message, MessageBuffer(bytes)).value();
  const std::uint32_t crc = crc32(MessageBytes(bytes.data(), size - sizeof message.crc));
  message.crc = static_cast<std::int32_t>(damaged ? ~crc : crc);
  static_cast<void>(write(message, MessageBuffer(bytes)));
  world.send_command(MessageBytes(bytes.data(), size));
}

/// Sets a parameter. `table`: what is added to the CRC of the table.
void set(World& world, int sequence, std::string_view name, double value, double table = 0.0) {
  const auto number = static_cast<double>(parameter_table().find(name) - parameter_table().rows().data());
  send(world, sequence, 3, {number, static_cast<double>(parameter_table_crc()) + table, value, 0.0});
}

}  // namespace

void send_command(World& world, int sequence, CommandId id) { send(world, sequence, static_cast<int>(id)); }

void add_command_faults(std::vector<Fault>& rows) {
  rows.push_back({"bad-commands",
                  "commands with a wrong checksum, an unknown id, an argument, and one twice",
                  10,
                  10,
                  [](World& w) {
                    send(w, 1, 2, {}, true);
                    send(w, 2, 77);
                    send(w, 3, 2, {1.0});
                    send(w, 4, 1);
                    send(w, 4, 1);
                    constexpr std::array<std::uint8_t, 3> kNoCommand{1, 2, 3};
                    w.send_command(kNoCommand);
                  },
                  nullptr,
                  {.events = {"command refused: checksum", "command refused: no such command",
                              "command refused: argument", "command refused: repeated", "command accepted"},
                   .same_states = true}});
  rows.push_back({"bad-parameter-commands",
                  "parameters set out of range, to no number, against others, that do not change, of another table",
                  10,
                  10,
                  [](World& w) {
                    set(w, 1, "range.gate_sigma", 1000.0);
                    set(w, 2, "range.gate_sigma", std::numeric_limits<double>::quiet_NaN());
                    set(w, 3, "range.min_range", 99.0);
                    set(w, 4, "imu.gravity", 1.6);
                    set(w, 5, "range.gate_sigma", 3.0, 1.0);
                  },
                  nullptr,
                  {.events = {"command refused: range", "command refused: conflict", "command refused: not in flight",
                              "command refused: other table"},
                   .same_states = true}});
  rows.push_back({"parameters-set",
                  "gates, noises and a time-out are set in the air, and 5 s later as they were",
                  10,
                  15,
                  [](World& w) {
                    set(w, 1, "range.gate_sigma", 3.0);
                    set(w, 2, "vision.pixel_noise", 1.5);
                    set(w, 3, "tracker.outlier", 0.6);
                    set(w, 4, "modes.image_timeout", 0.3);
                  },
                  [](World& w) {
                    set(w, 5, "range.gate_sigma", Parameters{}.estimator.range.gate_sigma);
                    set(w, 6, "vision.pixel_noise", Parameters{}.estimator.vision.pixel_noise_px);
                    set(w, 7, "tracker.outlier", Parameters{}.tracker.outlier_px);
                    set(w, 8, "modes.image_timeout", Parameters{}.modes.image_timeout_s);
                  },
                  {.events = {"command accepted", "range.gate_sigma set", "vision.pixel_noise set",
                              "tracker.outlier set", "modes.image_timeout set"}}});
  rows.push_back({"parameters-corrupted",
                  "one bit of a parameter fails in the memory of the tick, one in that of the nav job",
                  10,
                  10,
                  [](World& w) {
                    double& timeout_s = ParamStoreSeam::active(w.tick_parameters()).modes.image_timeout_s;
                    timeout_s = test::with_bit_flipped(timeout_s, 55);
                    double& noise_px = ParamStoreSeam::active(w.nav_parameters()).estimator.vision.pixel_noise_px;
                    noise_px = test::with_bit_flipped(noise_px, 60);
                  },
                  nullptr,
                  {.events = {"tick parameters mended", "nav parameters mended"}, .same_states = true}});
  rows.push_back({"command-flood",
                  "1000 commands at once",
                  10,
                  10,
                  [](World& w) {
                    for (int i = 1; i <= 1000; ++i) send(w, i, 1);
                  },
                  nullptr,
                  {.events = {"command accepted"}, .same_states = true}});
}

}  // namespace plumb::faults
