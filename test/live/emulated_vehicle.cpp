#include "test/live/emulated_vehicle.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <stdexcept>

#include "hal/linux/can_socket.h"
#include "hal/linux/frame_message.h"
#include "test/emulators/can_range/can_range_encoder.h"

namespace plumb::test {
namespace {

std::int64_t now_ns() { return emulator::Stim300OnPty::now_ns(); }

void sleep_until(std::int64_t t_ns) {
  std::this_thread::sleep_until(std::chrono::steady_clock::time_point(std::chrono::nanoseconds(t_ns)));
}

int listen_at(const std::filesystem::path& path) {
  const int file = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  const bool listens =
      file >= 0 && bind(file, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 && listen(file, 1) == 0;
  if (!listens) throw std::runtime_error("no socket at " + path.string());
  return file;
}

bool is_readable(int file, int timeout_ms) {
  pollfd waiting{.fd = file, .events = POLLIN, .revents = 0};
  return poll(&waiting, 1, timeout_ms) > 0;
}

std::vector<std::vector<std::uint8_t>> all_images(double longest_s) {
  const PlaneFlight flight(0.0);
  std::vector<std::vector<std::uint8_t>> images;
  const auto count = static_cast<std::int64_t>(longest_s * 1e9) / EmulatedVehicle::kImagePeriod_ns;
  for (std::int64_t i = 0; i < count; ++i) {
    images.push_back(flight.image(1e-9 * static_cast<double>(i * EmulatedVehicle::kImagePeriod_ns)));
  }
  return images;
}

}  // namespace

EmulatedVehicle::EmulatedVehicle(std::filesystem::path camera_socket, std::string can, double longest_s)
    : socket_path_(std::move(camera_socket)),
      can_(std::move(can)),
      images_(all_images(longest_s)),
      t_start_ns_(now_ns()),
      flight_(1e-9 * static_cast<double>(t_start_ns_)),
      listening_(listen_at(socket_path_)),
      imu_({}, 1) {
  imu_.with_unit([this](emulator::Stim300Emulator& unit) {
    unit.set_rate([this](double t_s) { return flight_.rate_rad_s(t_s); });
    unit.set_specific_force([this](double t_s) { return flight_.force_m_s2(t_s); });
  });
  camera_ = std::jthread([this](const std::stop_token& stop) { show(stop); });
  if (!can_.empty()) range_ = std::jthread([this](const std::stop_token& stop) { measure(stop); });
}

EmulatedVehicle::~EmulatedVehicle() {
  camera_ = {};
  range_ = {};
  close(listening_);
}

// A frame is sent at its end, exposure and readout after its middle less half an exposure.
void EmulatedVehicle::show(const std::stop_token& stop) {
  int client = -1;
  for (std::size_t i = 0; i < images_.size() && !stop.stop_requested(); ++i) {
    const std::int64_t t_middle_ns = t_start_ns_ + static_cast<std::int64_t>(i) * kImagePeriod_ns;
    const std::int64_t t_end_ns = t_middle_ns + kExposure_ns / 2 + kReadout_ns;
    sleep_until(t_end_ns);
    if (client < 0 && is_readable(listening_, 0)) client = accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) continue;
    std::array<std::uint8_t, kFrameMessageBytes> request{};
    while (is_readable(client, 0) && recv(client, request.data(), request.size(), 0) > 0) {
      const Result<CameraMode> wanted = decode_start(request);
      if (!wanted) continue;
      const FrameMessage answer = encode_abilities(
          {.mode = *wanted, .least = {Duration::from_us(10), 1.0}, .most = {Duration::from_ms(20), 16.0}});
      send(client, answer.data(), answer.size(), MSG_NOSIGNAL);
    }
    PortFrame frame;
    frame.image = {.pixels = images_[i].data(),
                   .width = PlaneFlight::kWidth,
                   .height = PlaneFlight::kHeight,
                   .stride = PlaneFlight::kWidth};
    frame.t = Time::from_ns(t_end_ns);
    frame.stamp = CameraStamp::kEndOfFrame;
    frame.sequence = static_cast<std::uint32_t>(i);
    frame.has_exposure = true;
    frame.exposure = {.time = Duration::from_ns(kExposure_ns), .gain = 1.0};
    const FrameMessage head = encode_frame(frame);
    std::vector<std::uint8_t> message(head.begin(), head.end());
    message.insert(message.end(), images_[i].begin(), images_[i].end());
    send(client, message.data(), message.size(), MSG_NOSIGNAL | MSG_DONTWAIT);  // what the host does not take is lost
  }
  if (client >= 0) close(client);
}

void EmulatedVehicle::measure(const std::stop_token& stop) {
  std::string error;
  const std::unique_ptr<LinuxCanSocket> bus = LinuxCanSocket::open(can_, error);
  if (bus == nullptr) throw std::runtime_error(error);
  for (unsigned i = 0; !stop.stop_requested(); ++i) {
    sleep_until(t_start_ns_ + static_cast<std::int64_t>(i) * kRangePeriod_ns);
    const double range_m = flight_.height_m(1e-9 * static_cast<double>(now_ns()));
    for (const CanFrame& frame : measurement_frames({}, range_m, 1, i % 32)) static_cast<void>(bus->send(frame));
  }
}

}  // namespace plumb::test
