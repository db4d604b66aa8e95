#include "test/emulators/uvc_camera/uvc_camera_on_usb.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <utility>

namespace plumb::emulator {
namespace {

const std::filesystem::path kController = "/sys/devices/platform/vhci_hcd.0";
constexpr int kPort = 0;
constexpr int kHighSpeed = 3;

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

template <typename Condition>
void wait_until(Condition condition, const char* what) {
  constexpr std::int64_t kPatience_ns = 20'000'000'000;
  for (const std::int64_t t_start = now_ns(); !condition();) {
    if (now_ns() - t_start > kPatience_ns) throw std::runtime_error(std::string("USB camera: ") + what);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

bool is_port_free() {
  std::ifstream status(kController / "status");
  std::string line;
  std::getline(status, line);  // what the columns are
  std::string hub;
  int port = -1;
  int state = 0;
  constexpr int kFree = 4;
  status >> hub >> port >> state;
  return port == kPort && state == kFree;
}

/// The first of its two devices is the one that captures images.
std::string video_device() {
  for (const auto& entry : std::filesystem::directory_iterator("/sys/class/video4linux")) {
    std::string name;
    int index = -1;
    std::getline(std::ifstream(entry.path() / "name"), name);
    std::ifstream(entry.path() / "index") >> index;
    const std::string device = "/dev/" + entry.path().filename().string();
    if (name.starts_with(uvc::kProduct) && index == 0 && std::filesystem::exists(device)) return device;
  }
  return {};
}

}  // namespace

UvcCameraOnUsb::UvcCameraOnUsb(uvc::Abilities abilities) : camera_(std::move(abilities)) { put_back(); }

UvcCameraOnUsb::~UvcCameraOnUsb() {
  try {
    pull();
  } catch (const std::exception& error) {
    std::cerr << "USB camera: " << error.what() << '\n';  // the next one that is plugged in fails
  }
}

void UvcCameraOnUsb::pull() {
  if (socket_ < 0) return;
  thread_ = {};
  close(socket_);
  socket_ = -1;
  waiting_.clear();
  sending_ = false;
  wait_until([] { return is_port_free() && video_device().empty(); }, "the kernel keeps it though it was pulled");
}

void UvcCameraOnUsb::put_back() {
  camera_.power_on();
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) throw std::runtime_error("no sockets");
  socket_ = ends[0];
  const std::string order = std::to_string(kPort) + ' ' + std::to_string(ends[1]) + ' ' + std::to_string(kUsbIpDevice) +
                            ' ' + std::to_string(kHighSpeed);
  const int attach = open((kController / "attach").c_str(), O_WRONLY | O_CLOEXEC);
  const bool taken = attach >= 0 && write(attach, order.data(), order.size()) == static_cast<ssize_t>(order.size());
  const int error = errno;
  if (attach >= 0) close(attach);
  close(ends[1]);  // the kernel has it
  if (!taken)
    throw std::runtime_error("USB camera: " + kController.string() + "/attach: error " + std::to_string(error));
  next_ns_ = now_ns();
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  wait_until([this] { return !(device_ = video_device()).empty(); }, "the kernel makes no video device for it");
}

void UvcCameraOnUsb::run(const std::stop_token& stop) {
  while (!stop.stop_requested() && exchange()) {
  }
}

/// False: the controller has closed the connection.
bool UvcCameraOnUsb::exchange() {
  constexpr std::int64_t kLongest_ns = 10'000'000;
  const std::int64_t left_ns = std::clamp<std::int64_t>(next_ns_ - now_ns(), 0, kLongest_ns);
  const timespec patience = {.tv_sec = 0, .tv_nsec = static_cast<long>(left_ns)};
  pollfd asked = {.fd = socket_, .events = POLLIN, .revents = 0};
  const bool is_asked = ppoll(&asked, 1, &patience, nullptr) > 0;
  const std::lock_guard lock(mutex_);
  if (is_asked) {
    const std::optional<UsbIpRequest> request = receive_request(socket_);
    if (!request) return false;
    answer(*request);
  }
  if (now_ns() >= next_ns_) make_image();
  if (sending_) send_payload();
  return true;
}

void UvcCameraOnUsb::answer(const UsbIpRequest& request) {
  if (request.unlinks) {
    const auto same = [&](const UsbIpRequest& other) { return other.number == *request.unlinks; };
    send_unlinked(socket_, request, std::erase_if(waiting_, same) > 0);
  } else if (request.endpoint == 0) {
    const std::optional<uvc::Bytes> told = camera_.control(request.setup, request.data);
    send_answer(socket_, request, told.value_or(uvc::Bytes{}), told ? 0 : EPIPE);  // EPIPE: STALL
    if (!camera_.is_streaming()) sending_ = false;
  } else {
    waiting_.push_back(request);
  }
}

/// The sensor has its own pace. What it made while the image before was still on its way is lost.
void UvcCameraOnUsb::make_image() {
  const std::int64_t end_ns = next_ns_;
  next_ns_ = std::max(next_ns_ + camera_.period_ns(), now_ns());
  if (!camera_.is_streaming() || sending_) return;
  payload_ = camera_.next_payload(end_ns);
  sent_ = 0;
  sending_ = true;
}

/// A transfer that is not filled ends the payload.
void UvcCameraOnUsb::send_payload() {
  while (sending_ && !waiting_.empty()) {
    const UsbIpRequest request = std::move(waiting_.front());
    waiting_.pop_front();
    const std::size_t size = std::min<std::size_t>(request.length, payload_.size() - sent_);
    send_answer(socket_, request, std::span(payload_).subspan(sent_, size));
    sent_ += size;
    sending_ = sent_ < payload_.size();
  }
}

}  // namespace plumb::emulator
