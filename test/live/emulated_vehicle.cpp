#include "test/live/emulated_vehicle.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <stdexcept>

#include "hal/linux/frame_message.h"

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

std::vector<std::vector<std::uint8_t>> all_images(double longest_s, std::int64_t period_ns) {
  const PlaneFlight flight(0.0);
  std::vector<std::vector<std::uint8_t>> images;
  const auto count = static_cast<std::int64_t>(longest_s * 1e9) / period_ns;
  for (std::int64_t i = 0; i < count; ++i) images.push_back(flight.image(1e-9 * static_cast<double>(i * period_ns)));
  return images;
}

std::unique_ptr<hil::VideoOutput> open_video(const std::string& device) {
  if (device.empty()) return nullptr;
  std::string error;
  auto video = hil::VideoOutput::open(device, PlaneFlight::kWidth, PlaneFlight::kHeight, error);
  if (video == nullptr) throw std::runtime_error(error);
  return video;
}

}  // namespace

EmulatedVehicle::EmulatedVehicle(VehicleInterfaces interfaces, double longest_s)
    : interfaces_(std::move(interfaces)),
      images_(all_images(longest_s, interfaces_.image_period_ns)),
      video_(open_video(interfaces_.camera_device)),
      listening_(interfaces_.camera_socket.empty() ? -1 : listen_at(interfaces_.camera_socket)),
      t_start_ns_(now_ns()),
      flight_(1e-9 * static_cast<double>(t_start_ns_)),
      imu_({}, 1) {
  imu_.with_unit([this](emulator::Stim300Emulator& unit) {
    unit.set_rate([this](double t_s) { return flight_.rate_rad_s(t_s); });
    unit.set_specific_force([this](double t_s) { return flight_.force_m_s2(t_s); });
  });
  camera_ = std::jthread([this](const std::stop_token& stop) { show(stop); });
  if (!interfaces_.can.empty()) {
    can_ = std::make_unique<CanRangeOnBus>(interfaces_.can, CanRangeEmulator::Kind::kDronecan, 1);
    can_->with_unit([this](CanRangeEmulator& unit) {
      unit.set_motion(
          [this](std::int64_t t_ns) { return std::optional(flight_.height_m(1e-9 * static_cast<double>(t_ns))); });
    });
  }
  if (interfaces_.lidar_lite != nullptr) {
    lidar_lite_ = std::make_unique<LidarLiteServed>(interfaces_.lidar_lite, "v3");
    range_ = std::jthread([this](const std::stop_token& stop) { measure_on_i2c(stop); });
  }
}

EmulatedVehicle::~EmulatedVehicle() {
  camera_ = {};
  range_ = {};
  can_ = {};
  if (listening_ >= 0) close(listening_);
}

void EmulatedVehicle::plug(VehicleDevice device, bool in) {
  away_[static_cast<std::size_t>(device)].store(!in);
  if (device == VehicleDevice::kImu) {
    imu_.with_unit([in](emulator::Stim300Emulator& unit) { unit.faults().unplugged = !in; });
  }
  if (device == VehicleDevice::kRange && can_ != nullptr) {
    can_->with_unit([in](CanRangeEmulator& unit) { unit.faults().silent = !in; });
  }
}

void EmulatedVehicle::disturb_imu(const emulator::Stim300Faults& faults) {
  imu_.with_unit([&faults](emulator::Stim300Emulator& unit) { unit.faults() = faults; });
}

// A frame is sent at its end, exposure and readout after its middle less half an exposure.
void EmulatedVehicle::show(const std::stop_token& stop) {
  int client = -1;
  for (std::size_t i = 0; i < images_.size() && !stop.stop_requested(); ++i) {
    const std::int64_t t_middle_ns = t_start_ns_ + static_cast<std::int64_t>(i) * interfaces_.image_period_ns;
    const std::int64_t t_end_ns = t_middle_ns + kExposure_ns / 2 + kReadout_ns;
    sleep_until(t_end_ns);
    if (is_away(VehicleDevice::kCamera)) {
      video_.reset();
      if (client >= 0) close(client);
      client = -1;
      continue;
    }
    if (video_ == nullptr) video_ = open_video(interfaces_.camera_device);
    if (video_ != nullptr) video_->write(images_[i]);
    if (listening_ >= 0) show_to_client(client, i, t_end_ns);
  }
  if (client >= 0) close(client);
}

void EmulatedVehicle::show_to_client(int& client, std::size_t index, std::int64_t t_end_ns) const {
  if (client < 0 && is_readable(listening_, 0)) client = accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return;
  std::array<std::uint8_t, kFrameMessageBytes> request{};
  while (is_readable(client, 0) && recv(client, request.data(), request.size(), 0) > 0) {
    const Result<CameraMode> wanted = decode_start(request);
    if (!wanted) continue;
    const FrameMessage answer = encode_abilities(
        {.mode = *wanted, .least = {Duration::from_us(10), 1.0}, .most = {Duration::from_ms(20), 16.0}});
    send(client, answer.data(), answer.size(), MSG_NOSIGNAL);
  }
  PortFrame frame;
  frame.image = {.pixels = images_[index].data(),
                 .width = PlaneFlight::kWidth,
                 .height = PlaneFlight::kHeight,
                 .stride = PlaneFlight::kWidth};
  frame.t = Time::from_ns(t_end_ns);
  frame.stamp = CameraStamp::kEndOfFrame;
  frame.sequence = static_cast<std::uint32_t>(index);
  frame.has_exposure = true;
  frame.exposure = {.time = Duration::from_ns(kExposure_ns), .gain = 1.0};
  const FrameMessage head = encode_frame(frame);
  std::vector<std::uint8_t> message(head.begin(), head.end());
  message.insert(message.end(), images_[index].begin(), images_[index].end());
  // What the host does not take is lost; a host that is gone may come again.
  if (send(client, message.data(), message.size(), MSG_NOSIGNAL | MSG_DONTWAIT) < 0 && errno == EPIPE) {
    close(client);
    client = -1;
  }
}

// The unit measures when it is asked to, what it was told last. It is pulled out with the adapter of its bus.
void EmulatedVehicle::measure_on_i2c(const std::stop_token& stop) {
  for (std::int64_t i = 0; !stop.stop_requested(); ++i) {
    sleep_until(t_start_ns_ + i * kRangePeriod_ns / 2);
    if (is_away(VehicleDevice::kRange)) {
      lidar_lite_.reset();
      continue;
    }
    if (lidar_lite_ == nullptr) lidar_lite_ = std::make_unique<LidarLiteServed>(interfaces_.lidar_lite, "v3");
    lidar_lite_->set("range_m " + std::to_string(flight_.height_m(1e-9 * static_cast<double>(now_ns()))));
  }
}

}  // namespace plumb::test
