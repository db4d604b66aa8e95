// An emulated LIDAR-Lite behind a real character device that answers as Linux's i2c-dev does:
//
//   lidar_lite_cuse NAME v3|v3hp|v4led      serves /dev/NAME until it is ended
//
// What the device sees is set by lines on standard input: `range_m METRES`, `no_target`, `dead 0|1`, `refuse_next N`.
// "ready" is printed once the device can be opened, and again when a line has been obeyed. Needs CUSE in the kernel
// (module cuse) and the right to use it.

#define FUSE_USE_VERSION 31
#include <cuse_lowlevel.h>
#include <fuse_opt.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>

#include <cerrno>
#include <iostream>
#include <map>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "hal/linux/monotonic_clock.h"
#include "test/emulators/lidar_lite/lidar_lite_emulator.h"

namespace {

using plumb::test::LidarLiteEmulator;

struct Server {
  explicit Server(LidarLiteEmulator::Kind kind) : device(kind) {}
  std::mutex mutex;  // between the bus and the lines of standard input
  LidarLiteEmulator device;
  std::uint8_t address = 0;  // set by I2C_SLAVE; there is one client
};

Server& server_of(fuse_req_t request) { return *static_cast<Server*>(fuse_req_userdata(request)); }

std::int64_t now_ns() { return plumb::clock_now().ns(); }

void on_open(fuse_req_t request, fuse_file_info* file) { fuse_reply_open(request, file); }

void on_read(fuse_req_t request, std::size_t size, off_t, fuse_file_info*) {
  Server& server = server_of(request);
  const std::lock_guard lock(server.mutex);
  std::vector<std::uint8_t> bytes(size);
  if (server.device.read(server.address, bytes, now_ns())) {
    fuse_reply_buf(request, reinterpret_cast<const char*>(bytes.data()), bytes.size());
  } else {
    fuse_reply_err(request, ENXIO);  // what adapters say of an address that nobody acknowledges
  }
}

void on_write(fuse_req_t request, const char* data, std::size_t size, off_t, fuse_file_info*) {
  Server& server = server_of(request);
  const std::lock_guard lock(server.mutex);
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(data), size);
  if (server.device.write(server.address, bytes, now_ns())) {
    fuse_reply_write(request, size);
  } else {
    fuse_reply_err(request, ENXIO);
  }
}

void on_ioctl(fuse_req_t request, int command, void* argument, fuse_file_info*, unsigned, const void*, std::size_t,
              std::size_t out_size) {
  const auto value = reinterpret_cast<std::uintptr_t>(argument);
  switch (static_cast<unsigned>(command)) {
    case I2C_SLAVE:
      if (value > 0x7F) {
        fuse_reply_err(request, EINVAL);
        return;
      }
      server_of(request).address = static_cast<std::uint8_t>(value);
      fuse_reply_ioctl(request, 0, nullptr, 0);
      return;
    case I2C_TIMEOUT:
    case I2C_RETRIES: fuse_reply_ioctl(request, 0, nullptr, 0); return;
    case I2C_FUNCS: {
      const unsigned long functions = I2C_FUNC_I2C;
      iovec out{.iov_base = argument, .iov_len = sizeof functions};
      if (out_size == 0) {
        fuse_reply_ioctl_retry(request, nullptr, 0, &out, 1);
      } else {
        fuse_reply_ioctl(request, 0, &functions, sizeof functions);
      }
      return;
    }
    // I2C_RDWR and I2C_SMBUS would make repeated starts, which the LIDAR-Lite v3 does not take.
    default: fuse_reply_err(request, ENOTTY); return;
  }
}

void on_init_done(void*) { std::cout << "ready" << std::endl; }

void obey(Server& server) {
  std::string line;
  while (std::getline(std::cin, line)) {
    std::istringstream words(line);
    std::string what;
    double value = 0.0;
    words >> what >> value;
    const std::lock_guard lock(server.mutex);
    if (what == "range_m") server.device.set_range_m(value);
    if (what == "no_target") server.device.set_range_m(std::nullopt);
    if (what == "dead") server.device.world.dead = value != 0.0;
    if (what == "refuse_next") server.device.world.refuse_next = static_cast<int>(value);
    std::cout << "ready" << std::endl;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::map<std::string, LidarLiteEmulator::Kind> kinds = {{"v3", LidarLiteEmulator::Kind::kV3},
                                                                {"v3hp", LidarLiteEmulator::Kind::kV3Hp},
                                                                {"v4led", LidarLiteEmulator::Kind::kV4Led}};
  if (argc != 3 || !kinds.contains(argv[2])) {
    std::cerr << "usage: lidar_lite_cuse NAME v3|v3hp|v4led\n";
    return 2;
  }
  Server server(kinds.at(argv[2]));
  std::thread(obey, std::ref(server)).detach();
  const std::string name = std::string("DEVNAME=") + argv[1];
  const char* properties[] = {name.c_str()};
  cuse_info info{};
  info.dev_info_argc = 1;
  info.dev_info_argv = properties;
  info.flags = CUSE_UNRESTRICTED_IOCTL;
  cuse_lowlevel_ops operations{};
  operations.init_done = on_init_done;
  operations.open = on_open;
  operations.read = on_read;
  operations.write = on_write;
  operations.ioctl = on_ioctl;
  char foreground[] = "-f";
  char one_thread[] = "-s";
  char* arguments[] = {argv[0], foreground, one_thread, nullptr};
  return cuse_lowlevel_main(3, arguments, &info, &operations, &server);
}
