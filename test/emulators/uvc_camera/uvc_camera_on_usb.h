#pragma once
// The emulated camera at a port of the kernel's virtual USB controller (vhci_hcd), in real time: for the kernel and all
// programs it is a USB camera.

#include <cstdint>
#include <deque>
#include <mutex>
#include <span>
#include <string>
#include <thread>

#include "test/emulators/uvc_camera/usbip_link.h"
#include "test/emulators/uvc_camera/uvc_camera.h"

namespace plumb::emulator {

class UvcCameraOnUsb {
 public:
  /// Plugs it in. Throws where the kernel does not take it.
  explicit UvcCameraOnUsb(uvc::Abilities abilities = {});
  ~UvcCameraOnUsb();
  UvcCameraOnUsb(const UvcCameraOnUsb&) = delete;
  UvcCameraOnUsb& operator=(const UvcCameraOnUsb&) = delete;

  /// The camera is gone until put_back(), which returns when the kernel has its device again.
  void pull();
  void put_back();
  /// What the kernel calls it, as "/dev/video2".
  const std::string& device() const { return device_; }

  /// Calls body(camera) while it does nothing.
  template <typename Body>
  void with(Body body) {
    const std::lock_guard lock(mutex_);
    body(camera_);
  }

 private:
  void run(const std::stop_token& stop);
  bool exchange();
  void answer(const UsbIpRequest& request);
  void make_image();
  void send_payload();

  std::mutex mutex_;
  UvcCamera camera_;
  std::string device_;
  int socket_ = -1;
  std::deque<UsbIpRequest> waiting_;  ///< transfers of the stream that the controller has asked for
  uvc::Bytes payload_;
  std::size_t sent_ = 0;  ///< of the payload
  bool sending_ = false;
  std::int64_t next_ns_ = 0;  ///< end of the next exposure
  std::jthread thread_;       // last: it uses the others
};

}  // namespace plumb::emulator
