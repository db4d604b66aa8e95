#pragma once
// The messages by which Linux's virtual USB controller (vhci_hcd) talks to a device at the other end of a socket.
// Source: Linux, Documentation/usb/usbip_protocol.rst.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "test/emulators/uvc_camera/uvc_camera.h"

namespace plumb::emulator {

inline constexpr std::uint32_t kUsbIpDevice =
    0x00010002;  ///< its bus and number where it is, as told to the controller

/// A transfer that the controller asks for or, with `unlinks`, one that it does not want any more.
struct UsbIpRequest {
  std::uint32_t number = 0;
  bool to_host = false;
  std::uint32_t endpoint = 0;
  std::uint32_t length = 0;  ///< bytes sent, or expected at most
  UsbSetup setup;
  std::vector<std::uint8_t> data;          ///< that the host sends
  std::optional<std::uint32_t> unlinks{};  ///< number of the transfer
};

/// The next request. Nothing: the controller has closed the socket.
std::optional<UsbIpRequest> receive_request(int socket);
/// The end of a transfer, with the data for the host, or with an error number.
void send_answer(int socket, const UsbIpRequest& request, std::span<const std::uint8_t> data, int error = 0);
/// `was_waiting`: the transfer will not be answered any more.
void send_unlinked(int socket, const UsbIpRequest& request, bool was_waiting);

}  // namespace plumb::emulator
