#pragma once
// A camera daemon with the emulated sensor behind it, on a real Unix socket and in real time on CLOCK_MONOTONIC. It
// writes the messages byte by byte from their documentation.

#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "test/emulators/ov7251/ov7251_emulator.h"

namespace plumb::emulator {

class CameraDaemon {
 public:
  explicit CameraDaemon(std::string path);
  ~CameraDaemon();
  CameraDaemon(const CameraDaemon&) = delete;
  CameraDaemon& operator=(const CameraDaemon&) = delete;

  struct Behaviour {
    bool answers = true;  ///< to START
    int stamp = 0;        ///< of the frames, as the protocol numbers them
    std::int64_t stamp_error_ns = 0;
    bool tells_exposure = true;
    int garbage = 0;                     ///< messages that are none, before the next frame
    int width = Ov7251Emulator::kWidth;  ///< as told in frames and in the answer
  };
  /// Calls body(sensor, behaviour) while the daemon does nothing.
  template <typename Body>
  void with(Body body) {
    const std::lock_guard lock(mutex_);
    body(sensor_, behaviour_);
  }
  /// What was sent, in order.
  std::vector<Ov7251Image> sent() {
    const std::lock_guard lock(mutex_);
    return sent_;
  }
  /// Of the newest START, as the protocol numbers it; -1: none came.
  int trigger() {
    const std::lock_guard lock(mutex_);
    return trigger_;
  }

 private:
  void run(const std::stop_token& stop);
  void exchange();
  void accept_client();
  void on_request(const std::vector<std::uint8_t>& request);
  void send_frame(const Ov7251Image& image);

  std::string path_;
  int listening_ = -1;
  int client_ = -1;
  std::mutex mutex_;
  Ov7251Emulator sensor_;
  Behaviour behaviour_;
  bool streaming_ = false;
  int trigger_ = -1;
  std::vector<Ov7251Image> sent_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace plumb::emulator
