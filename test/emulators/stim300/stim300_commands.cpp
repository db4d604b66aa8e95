// What the emulated unit does when it is spoken to (TS1524 rev.31, sections 8 and 9).

#include <algorithm>

#include "test/emulators/stim300/stim300_emulator.h"

namespace plumb::emulator {
namespace {

constexpr const char* kUnknown = "E001 UNKNOWN COMMAND";
constexpr const char* kCount = "E002 INVALID NUMBER OF PARAMETERS";
constexpr const char* kInvalid = "E003 INVALID PARAMETER";
constexpr const char* kTooLong = "E007 DATAGRAM TOO LONG";

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts = {""};
  for (const char c : text) {
    if (c == ',') {
      parts.emplace_back();
    } else {
      parts.back().push_back(c);
    }
  }
  return parts;
}

// A single character out of a list: its place, or -1.
int place(const std::string& parameter, const std::string& list) {
  const std::size_t at = parameter.size() == 1 ? list.find(parameter) : std::string::npos;
  return at == std::string::npos ? -1 : static_cast<int>(at);
}

const char* change_rate(Stim300Setup& setup, const std::vector<std::string>& p) {
  if (p.size() != 1) return kCount;
  if (place(p[0], "01234") < 0) return kInvalid;
  setup.rate_code = place(p[0], "01234");
  return nullptr;
}

const char* change_content(Stim300Setup& setup, const std::vector<std::string>& p) {
  if (p.size() != 2) return kCount;
  const int content = place(p[0], "01234567lmnpqrst");
  if (content < 0 || place(p[1], "01") < 0) return kInvalid;
  setup.accelerometer = (content & 1) != 0;
  setup.inclinometer = (content & 2) != 0;
  setup.temperatures = (content & 4) != 0;
  setup.pps = content >= 8;
  setup.cr_lf = p[1] == "1";
  return nullptr;
}

const char* change_unit(Stim300Setup& setup, const std::vector<std::string>& p) {
  if (p.size() != 2) return kCount;
  const int gyro_unit = place(p[1], "0123....89ab");
  const int accel_unit = place(p[1], "01234");
  if (p[0] == "g" && gyro_unit >= 0 && p[1] != ".") {
    setup.gyro_unit = gyro_unit;
  } else if (p[0] == "a" && accel_unit >= 0) {
    setup.accel_unit = accel_unit;
  } else {
    return kInvalid;
  }
  return nullptr;
}

const char* change_filter(Stim300Setup& setup, const std::vector<std::string>& p) {
  if (p.size() > 2) return kCount;
  const int filter = place(p[0], "01234");
  const bool all = p.size() == 1;
  if (filter < 0 || (!all && p[1] != "g" && p[1] != "a")) return kInvalid;
  if (all || p[1] == "g") setup.gyro_filter = filter;
  if (all || p[1] == "a") setup.accel_filter = filter;
  return nullptr;
}

bool fits_line(const Stim300Setup& setup) {
  return encode_normal(setup, {}).size() * 10 * static_cast<unsigned>(setup.rate_hz()) <= setup.baud;
}

}  // namespace

void Stim300Emulator::receive(std::span<const std::uint8_t> bytes, std::int64_t t_ns) {
  for (const std::uint8_t byte : bytes) {
    std::string reply;
    if (service_mode_) reply.push_back(static_cast<char>(byte));  // echo
    if (byte != '\r') {
      line_.push_back(static_cast<char>(byte));
    } else if (service_mode_) {
      reply += on_service_command(line_, t_ns);
      line_.clear();
    } else {
      on_normal_command(line_, t_ns);
      line_.clear();
    }
    if (!reply.empty()) send(Bytes(reply.begin(), reply.end()), std::max(t_ns, t_line_free_ns_));
  }
}

// Never echoed, never answered but by the datagram asked for.
void Stim300Emulator::on_normal_command(const std::string& command, std::int64_t t_ns) {
  if (command == "C") requested_ = encode_configuration(setup_);
  if (command == "I") requested_ = encode_serial_number(setup_);
  if (command == "N") requested_ = encode_part_number(setup_);
  if (command == "R") restart(t_ns);
  if (command == "SERVICEMODE") {
    service_mode_ = true;
    const std::string greeting = "SERVICEMODE\r>";
    send(Bytes(greeting.begin(), greeting.end()), std::max(t_ns, t_line_free_ns_));
  }
}

std::string Stim300Emulator::on_service_command(const std::string& command, std::int64_t t_ns) {
  if (asking_to_save_) {
    asking_to_save_ = false;
    if (command == "Y") saved_ = setup_;
    return "\r>";
  }
  if (command == "s") {
    asking_to_save_ = true;
    return "SAVE CONFIGURATION PERMANENTLY (Y/N)? ";
  }
  if (command == "x N" || command == "x I") {
    service_mode_ = false;
    summed_ = 0;
    gyro_sum_ = accel_sum_ = {};
    if (command == "x I") restart(t_ns);
    return "";
  }
  Stim300Setup changed = setup_;
  const char* error = kUnknown;
  if (command.size() >= 3 && command[1] == ' ') {
    const std::vector<std::string> parameters = split(command.substr(2));
    switch (command[0]) {
      case 'm': error = change_rate(changed, parameters); break;
      case 'd': error = change_content(changed, parameters); break;
      case 'u': error = change_unit(changed, parameters); break;
      case 'f': error = change_filter(changed, parameters); break;
      default: break;
    }
  }
  if (error == nullptr && !fits_line(changed)) error = kTooLong;
  if (error != nullptr) return std::string(error) + "\r>";
  setup_ = changed;
  return "\r>";
}

}  // namespace plumb::emulator
