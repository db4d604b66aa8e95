#pragma once
// A USB camera in software, of the USB Video Class 1.1: a grey sensor with a global shutter behind a bridge that hands
// its images on while they are read out. Two faces: the bus, where control requests and the payloads of a bulk endpoint
// are exchanged byte by byte, and the world, where a test sets what the sensor sees and what is wrong with it, and asks
// what was told to it. Written from the specifications; it shares no code with Plumb's drivers.

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "test/emulators/uvc_camera/uvc_descriptors.h"

namespace plumb::emulator {

/// The first stage of a control transfer.
struct UsbSetup {
  std::uint8_t request_type = 0;
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  std::uint16_t length = 0;
};

/// An image that was made.
struct UvcImage {
  std::uint32_t number = 0;  ///< counted from 0
  std::int64_t end_of_exposure_ns = 0;
  std::uint32_t exposure_100us = 0;
  std::uint16_t gain = 0;  ///< sixteenths
  double fill_per_ms = 0.0;
  uvc::Pixels pixels = uvc::Pixels::kGrey;

  std::int64_t exposure_ns() const { return std::int64_t{exposure_100us} * 100'000; }
  std::int64_t middle_ns() const { return end_of_exposure_ns - exposure_ns() / 2; }
  /// The pixel as the sensor had it, 10 bits.
  std::uint16_t pixel(int u, int v) const;
};

class UvcCamera {
 public:
  static constexpr std::uint32_t kLeastExposure_100us = 1;
  static constexpr std::uint32_t kMostExposure_100us = 320;
  static constexpr std::uint16_t kLeastGain = 16;
  static constexpr std::uint16_t kMostGain = 1023;
  /// Modes of the automatic exposure, a bit each.
  static constexpr std::uint8_t kManual = 1;
  static constexpr std::uint8_t kAutomatic = 8;
  static constexpr std::uint32_t kPayloadHeaderBytes = 6;
  /// What is set acts on the second image that begins afterwards.
  static constexpr std::size_t kControlDelay = 2;

  explicit UvcCamera(uvc::Abilities abilities = {}) : abilities_(std::move(abilities)) {}

  // The bus.
  /// Plugged in: what was set is forgotten.
  void power_on();
  /// The answer to a control request, none of it where the host sends the data; nothing: STALL.
  std::optional<uvc::Bytes> control(const UsbSetup& setup, std::span<const std::uint8_t> data);
  bool is_streaming() const { return streaming_; }
  std::int64_t period_ns() const { return std::int64_t{period_100ns_} * 100; }
  /// The payload of the image whose exposure ends now.
  uvc::Bytes next_payload(std::int64_t end_of_exposure_ns);

  // The world.
  /// The brightest part of the scene: the part of a pixel's range that an exposure of 1 ms with gain 1 fills. The scene
  /// goes from black to that evenly, and moves from image to image.
  void set_scene(double fill_per_ms) { fill_per_ms_ = fill_per_ms; }
  struct World {
    int stall_exposures = 0;      ///< the next so many times that the exposure is set, it is not taken
    std::uint32_t held_step = 1;  ///< the sensor holds multiples of so many units of exposure, rounded down
  };
  World world;

  // What it was told.
  struct Settings {
    std::uint8_t auto_exposure = kAutomatic;
    std::uint32_t exposure_100us = 157;
    std::uint16_t gain = kLeastGain;
  };
  const Settings& settings() const { return settings_; }
  const std::vector<UvcImage>& images() const { return images_; }

 private:
  std::optional<uvc::Bytes> standard_request(const UsbSetup& setup);
  std::optional<uvc::Bytes> control_interface(const UsbSetup& setup, std::span<const std::uint8_t> data);
  std::optional<uvc::Bytes> streaming_interface(const UsbSetup& setup, std::span<const std::uint8_t> data);
  std::optional<uvc::Bytes> refuse(std::uint8_t reason);
  std::optional<uvc::Bytes> set_exposure(std::uint32_t wanted_100us);
  uvc::Bytes negotiated() const;
  void negotiate(std::span<const std::uint8_t> wanted);
  uvc::Pixels pixels() const { return abilities_.formats.at(format_ - 1U); }

  uvc::Abilities abilities_;
  Settings settings_;
  std::deque<Settings> pending_;  ///< of the images to come
  double fill_per_ms_ = 0.05;
  std::uint8_t request_error_ = 0;
  std::uint8_t format_ = 1;
  std::uint32_t period_100ns_ = 0;
  bool streaming_ = false;
  std::vector<UvcImage> images_;
};

}  // namespace plumb::emulator
