#include "test/emulators/uvc_camera/uvc_camera.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace plumb::emulator {
namespace {

using uvc::Bytes;
using uvc::Pixels;

// Requests of the standard and of the class.
constexpr std::uint8_t kFromDevice = 0x80;
constexpr std::uint8_t kOfClass = 0x20;
constexpr std::uint8_t kClearFeature = 1;
constexpr std::uint8_t kSetCur = 0x01;
constexpr std::uint8_t kGetCur = 0x81;
constexpr std::uint8_t kGetLen = 0x85;
constexpr std::uint8_t kGetInfo = 0x86;
constexpr std::uint8_t kGetDef = 0x87;

// Controls of the units and of the streaming interface.
constexpr std::uint8_t kAutoExposureMode = 2;
constexpr std::uint8_t kExposureTime = 4;
constexpr std::uint8_t kGain = 4;
constexpr std::uint8_t kRequestError = 2;
constexpr std::uint8_t kProbe = 1;
constexpr std::uint8_t kCommit = 2;

// Why a request was refused.
constexpr std::uint8_t kWrongState = 2;
constexpr std::uint8_t kOutOfRange = 4;
constexpr std::uint8_t kInvalidControl = 6;
constexpr std::uint8_t kInvalidRequest = 7;

constexpr std::uint8_t kCanGetAndSet = 0x03;
constexpr std::uint8_t kChangesByItself = 0x08;

constexpr std::size_t kNegotiationBytes = 34;

constexpr int kFullScale = 1023;
constexpr int kLevels = 256;
// Of the number of an image, a byte each in the upper bits of the first pixels; the lower two say nothing.
constexpr int kNumberPixels = 4;
constexpr std::uint16_t kLowBits = 3;

// The scene: its levels in turn, another one for each column, row and image.
int level_at(std::uint32_t number, int u, int v) {
  return static_cast<int>((static_cast<std::uint32_t>(u + 2 * v) + 3 * number) % kLevels);
}

std::uint16_t light_at(const UvcImage& image, int level) {
  const double light_ms = 1e-6 * static_cast<double>(image.exposure_ns()) * image.gain / UvcCamera::kLeastGain;
  const double fill = image.fill_per_ms * light_ms * level / (kLevels - 1);
  return static_cast<std::uint16_t>(std::lround(std::min(fill, 1.0) * kFullScale));
}

std::uint16_t number_pixel(std::uint32_t number, int u) {
  return static_cast<std::uint16_t>((number >> (8 * u) & 0xFFU) << 2U | kLowBits);
}

void put_pixel(Bytes& bytes, std::uint16_t value, Pixels pixels) {
  if (pixels == Pixels::kY10) {
    uvc::put(bytes, value, 2);
  } else {
    uvc::put(bytes, value >> 2U, 1);
  }
}

// What a control with a number says of itself. `values`: present, least, most, step and default, as the requests for
// them are numbered from GET_CUR on, but for the last.
Bytes number_control(const UsbSetup& setup, const std::array<std::uint32_t, 5>& values, int size) {
  Bytes told;
  switch (setup.request) {
    case kGetLen: uvc::put(told, static_cast<std::uint32_t>(size), 2); break;
    case kGetInfo: told.push_back(kCanGetAndSet | kChangesByItself); break;
    case kGetDef: uvc::put(told, values[4], size); break;
    default: uvc::put(told, values.at(setup.request - kGetCur), size);
  }
  return told;
}

}  // namespace

std::uint16_t UvcImage::pixel(int u, int v) const {
  return v == 0 && u < kNumberPixels ? number_pixel(number, u) : light_at(*this, level_at(number, u, v));
}

void UvcCamera::power_on() {
  settings_ = {};
  pending_.clear();
  request_error_ = 0;
  format_ = 1;
  period_100ns_ = abilities_.periods_100ns.front();
  streaming_ = false;
}

std::optional<Bytes> UvcCamera::control(const UsbSetup& setup, std::span<const std::uint8_t> data) {
  std::optional<Bytes> answer;
  if ((setup.request_type & kOfClass) == 0) {
    answer = standard_request(setup);
  } else if ((setup.index & 0xFFU) == uvc::kControlInterface) {
    answer = control_interface(setup, data);
  } else {
    answer = streaming_interface(setup, data);
  }
  if (answer && answer->size() > setup.length) answer->resize(setup.length);
  return answer;
}

std::optional<Bytes> UvcCamera::standard_request(const UsbSetup& setup) {
  constexpr std::uint8_t kGetStatus = 0;
  constexpr std::uint8_t kGetDescriptor = 6;
  constexpr std::uint8_t kGetConfiguration = 8;
  constexpr std::uint8_t kGetInterface = 10;
  if ((setup.request_type & kFromDevice) == 0) {
    // So the host tells a camera with a bulk endpoint that the stream ends.
    if (setup.request == kClearFeature && setup.index == uvc::kStreamEndpoint) streaming_ = false;
    return Bytes{};
  }
  switch (setup.request) {
    case kGetStatus: return Bytes{0, 0};
    case kGetConfiguration: return Bytes{1};
    case kGetInterface: return Bytes{0};
    case kGetDescriptor: break;
    default: return {};
  }
  const auto type = static_cast<std::uint8_t>(setup.value >> 8U);
  Bytes told = uvc::descriptor(type, static_cast<std::uint8_t>(setup.value & 0xFFU), abilities_);
  if (told.empty()) return {};
  return told;
}

std::optional<Bytes> UvcCamera::refuse(std::uint8_t reason) {
  request_error_ = reason;
  return {};
}

std::optional<Bytes> UvcCamera::set_exposure(std::uint32_t wanted_100us) {
  if (world.stall_exposures > 0) {
    --world.stall_exposures;
    return refuse(kWrongState);
  }
  if (settings_.auto_exposure != kManual) return refuse(kWrongState);
  if (wanted_100us < kLeastExposure_100us || wanted_100us > kMostExposure_100us) return refuse(kOutOfRange);
  settings_.exposure_100us = std::max(wanted_100us / world.held_step * world.held_step, kLeastExposure_100us);
  return Bytes{};
}

std::optional<Bytes> UvcCamera::control_interface(const UsbSetup& setup, std::span<const std::uint8_t> data) {
  const auto unit = static_cast<std::uint8_t>(setup.index >> 8U);
  const auto control = static_cast<std::uint8_t>(setup.value >> 8U);
  const bool sets = setup.request == kSetCur;
  if (unit == 0 && control == kRequestError && setup.request == kGetCur) return Bytes{request_error_};
  request_error_ = 0;
  if (!sets && (setup.request < kGetCur || setup.request > kGetDef)) return refuse(kInvalidRequest);
  if (unit == uvc::kCameraTerminal && control == kAutoExposureMode && abilities_.has_exposure) {
    if (!sets) return number_control(setup, {settings_.auto_exposure, 0, 0, kManual | kAutomatic, kAutomatic}, 1);
    if (data.size() != 1 || (data[0] != kManual && data[0] != kAutomatic)) return refuse(kOutOfRange);
    settings_.auto_exposure = data[0];
    return Bytes{};
  }
  if (unit == uvc::kCameraTerminal && control == kExposureTime && abilities_.has_exposure) {
    if (!sets) {
      const std::uint32_t by_default = Settings{}.exposure_100us;
      return number_control(setup, {settings_.exposure_100us, kLeastExposure_100us, kMostExposure_100us, 1, by_default},
                            4);
    }
    if (data.size() != 4) return refuse(kOutOfRange);
    return set_exposure(uvc::get(data, 0, 4));
  }
  if (unit == uvc::kProcessingUnit && control == kGain) {
    if (!sets) return number_control(setup, {settings_.gain, kLeastGain, kMostGain, 1, kLeastGain}, 2);
    if (data.size() != 2) return refuse(kOutOfRange);
    const auto wanted = static_cast<std::uint16_t>(uvc::get(data, 0, 2));
    if (wanted < kLeastGain || wanted > kMostGain) return refuse(kOutOfRange);
    settings_.gain = wanted;
    return Bytes{};
  }
  return refuse(kInvalidControl);
}

Bytes UvcCamera::negotiated() const {
  Bytes told = {1, 0, format_, 1};
  uvc::put(told, period_100ns_, 4);
  told.insert(told.end(), 8, 0);  // of compressed formats
  uvc::put(told, 0, 2);           // delay
  uvc::put(told, uvc::image_bytes(pixels()), 4);
  uvc::put(told, kPayloadHeaderBytes + uvc::image_bytes(pixels()), 4);  // an image is one payload
  uvc::put(told, uvc::kClock_hz, 4);
  told.insert(told.end(), {3, 0, 0, 0});  // headers tell of each image's begin and end
  return told;
}

void UvcCamera::negotiate(std::span<const std::uint8_t> wanted) {
  if (wanted[2] >= 1 && wanted[2] <= abilities_.formats.size()) format_ = wanted[2];
  const std::uint32_t period = uvc::get(wanted, 4, 4);
  const std::vector<std::uint32_t>& has = abilities_.periods_100ns;
  if (std::find(has.begin(), has.end(), period) != has.end()) period_100ns_ = period;
}

std::optional<Bytes> UvcCamera::streaming_interface(const UsbSetup& setup, std::span<const std::uint8_t> data) {
  const auto control = static_cast<std::uint8_t>(setup.value >> 8U);
  if (control != kProbe && control != kCommit) return {};
  if (setup.request == kGetLen) return Bytes{kNegotiationBytes, 0};
  if (setup.request == kGetInfo) return Bytes{kCanGetAndSet};
  if (setup.request != kSetCur) return negotiated();
  if (data.size() < kNegotiationBytes) return {};
  negotiate(data);
  streaming_ = control == kCommit;
  return Bytes{};
}

Bytes UvcCamera::next_payload(std::int64_t end_of_exposure_ns) {
  pending_.push_back(settings_);
  while (pending_.size() > kControlDelay + 1) pending_.pop_front();
  const UvcImage image{.number = static_cast<std::uint32_t>(images_.size()),
                       .end_of_exposure_ns = end_of_exposure_ns,
                       .exposure_100us = pending_.front().exposure_100us,
                       .gain = pending_.front().gain,
                       .fill_per_ms = fill_per_ms_,
                       .pixels = pixels()};
  images_.push_back(image);

  Bytes payload;
  payload.reserve(kPayloadHeaderBytes + uvc::image_bytes(image.pixels));
  // Which of two images, its end, and the camera's time at the begin of its exposure.
  constexpr std::uint8_t kEndOfHeader = 0x80;
  constexpr std::uint8_t kHasTime = 0x04;
  constexpr std::uint8_t kEndOfImage = 0x02;
  const auto other = static_cast<std::uint8_t>(image.number & 1U);
  payload.insert(payload.end(),
                 {kPayloadHeaderBytes, static_cast<std::uint8_t>(kEndOfHeader | kHasTime | kEndOfImage | other)});
  constexpr std::int64_t kNsPerTick = 1'000'000'000 / uvc::kClock_hz;
  uvc::put(payload, static_cast<std::uint32_t>((end_of_exposure_ns - image.exposure_ns()) / kNsPerTick), 4);

  // A row is a piece of this strip: an emulated processor would be too slow for each pixel by itself.
  Bytes strip;
  for (int i = 0; i < kLevels + uvc::kWidth; ++i) put_pixel(strip, light_at(image, i % kLevels), image.pixels);
  const auto size = static_cast<std::ptrdiff_t>(uvc::bytes_per_pixel(image.pixels));
  for (int v = 0; v < uvc::kHeight; ++v) {
    const auto from = strip.begin() + size * level_at(image.number, 0, v);
    payload.insert(payload.end(), from, from + size * uvc::kWidth);
  }
  Bytes number;
  for (int u = 0; u < kNumberPixels; ++u) put_pixel(number, number_pixel(image.number, u), image.pixels);
  std::copy(number.begin(), number.end(), payload.begin() + kPayloadHeaderBytes);
  return payload;
}

}  // namespace plumb::emulator
