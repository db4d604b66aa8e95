#pragma once
// plumb-fsw beside the emulated vehicle: its configuration, its process, and what it says at its end.

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace plumb::test {

/// The configuration file of a plane flight. `camera`: the key and value that say where it is. `more`: further
/// sections.
std::string flight_configuration(const std::string& imu_device, double image_rate_hz, const std::filesystem::path& log,
                                 const std::string& camera, const std::string& more);

/// The section of a range finder beside the camera. `device`: the key and value that say what it is.
std::string range_section(const std::string& device);

/// plumb-fsw with its output in a file.
class FlightProgram {
 public:
  /// `words`: program and arguments, found as the shell does. Throws std::runtime_error.
  FlightProgram(std::vector<std::string> words, std::filesystem::path output);
  ~FlightProgram();
  FlightProgram(const FlightProgram&) = delete;
  FlightProgram& operator=(const FlightProgram&) = delete;

  /// Ends it in order, by SIGTERM. Exit code, -1 when a signal ended it.
  int stop();
  /// Until it ends by itself; as stop().
  int wait();
  /// Ends it without giving it time for anything.
  void kill();
  void send(int signal) const;
  std::string output() const;

 private:
  std::filesystem::path output_;
  pid_t process_ = -1;
};

/// The number behind a word in the program's summary; -1 where the word is missing.
long number_after(const std::string& text, const std::string& word);

}  // namespace plumb::test
