#include "test/emulators/uvc_camera/usbip_link.h"

#include <sys/socket.h>
#include <sys/uio.h>

#include <array>
#include <cerrno>
#include <stdexcept>
#include <string>

namespace plumb::emulator {
namespace {

constexpr std::uint32_t kSubmit = 1;
constexpr std::uint32_t kUnlink = 2;
constexpr std::uint32_t kSubmitted = 3;
constexpr std::uint32_t kUnlinked = 4;
constexpr std::uint32_t kToHost = 1;
constexpr std::size_t kHeaderBytes = 48;
constexpr std::size_t kSetupOffset = 40;

using Header = std::array<std::uint8_t, kHeaderBytes>;

// Words have their high byte first, unlike those of USB itself.
std::uint32_t word(const Header& header, std::size_t index) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8U | header.at(4 * index + i);
  return value;
}

void set_word(Header& header, std::size_t index, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i)
    header.at(4 * index + i) = static_cast<std::uint8_t>(value >> (24 - 8 * i) & 0xFFU);
}

bool receive_all(int socket, std::span<std::uint8_t> bytes) {
  return bytes.empty() || recv(socket, bytes.data(), bytes.size(), MSG_WAITALL) == static_cast<ssize_t>(bytes.size());
}

// A controller that has gone away is seen where its next request is waited for.
void send_all(int socket, Header& header, std::span<const std::uint8_t> data) {
  std::array<iovec, 2> parts = {iovec{.iov_base = header.data(), .iov_len = header.size()},
                                iovec{.iov_base = const_cast<std::uint8_t*>(data.data()), .iov_len = data.size()}};
  msghdr message{};
  message.msg_iov = parts.data();
  message.msg_iovlen = parts.size();
  (void)sendmsg(socket, &message, MSG_NOSIGNAL);
}

UsbSetup setup_of(const Header& header) {
  const std::span<const std::uint8_t> bytes = std::span(header).subspan(kSetupOffset);
  const auto number = [bytes](std::size_t offset) { return static_cast<std::uint16_t>(uvc::get(bytes, offset, 2)); };
  return {.request_type = bytes[0], .request = bytes[1], .value = number(2), .index = number(4), .length = number(6)};
}

}  // namespace

std::optional<UsbIpRequest> receive_request(int socket) {
  Header header{};
  if (!receive_all(socket, header)) return {};
  UsbIpRequest request;
  request.number = word(header, 1);
  if (word(header, 0) == kUnlink) {
    request.unlinks = word(header, 5);
    return request;
  }
  if (word(header, 0) != kSubmit) throw std::runtime_error("USB/IP: command " + std::to_string(word(header, 0)));
  request.to_host = word(header, 3) == kToHost;
  request.endpoint = word(header, 4);
  request.length = word(header, 6);
  request.setup = setup_of(header);
  if (!request.to_host) request.data.resize(request.length);
  if (!receive_all(socket, request.data)) return {};
  return request;
}

void send_answer(int socket, const UsbIpRequest& request, std::span<const std::uint8_t> data, int error) {
  Header header{};
  set_word(header, 0, kSubmitted);
  set_word(header, 1, request.number);
  set_word(header, 5, static_cast<std::uint32_t>(-error));
  set_word(header, 6, request.to_host ? static_cast<std::uint32_t>(data.size()) : request.length);
  send_all(socket, header, data);
}

void send_unlinked(int socket, const UsbIpRequest& request, bool was_waiting) {
  Header header{};
  set_word(header, 0, kUnlinked);
  set_word(header, 1, request.number);
  set_word(header, 5, static_cast<std::uint32_t>(was_waiting ? -ECONNRESET : 0));
  send_all(socket, header, {});
}

}  // namespace plumb::emulator
