#pragma once
// The devices of the plane flight behind the ports of the drivers, on the clock of a simulated world, and what can go
// wrong with them. Bytes are made by the emulators of the devices; a fault changes bytes, images or when they come.

#include <cstdint>
#include <deque>
#include <vector>

#include "hal/include/camera_port.h"
#include "hal/include/can_socket.h"
#include "hal/include/i2c_bus.h"
#include "hal/include/serial_port.h"
#include "test/emulators/lidar_lite/lidar_lite_emulator.h"
#include "test/emulators/stim300/stim300_emulator.h"
#include "test/live/plane_flight.h"

namespace plumb::faults {

/// Beside those of the emulated unit itself.
struct ImuLineFaults {
  bool doubled = false;    ///< every datagram comes twice
  bool swapped = false;    ///< of two datagrams the second comes first
  bool saturated = false;  ///< the accelerometers are shaken to their limits
  bool gone = false;       ///< the line itself: reading fails
};

struct CameraFaults {
  bool dead = false;
  bool stuck = false;    ///< the last image again and again, with new stamps
  bool doubled = false;  ///< every frame comes twice
  bool swapped = false;  ///< of two frames the second comes first
  bool black = false;
  bool noise = false;        ///< pixels that have nothing to do with the scene
  bool damaged = false;      ///< the source says so
  bool half_size = false;    ///< images of another size
  std::int64_t late_ns = 0;  ///< frames arrive that much later, stamped as they should be
  std::int64_t stamp_error_ns = 0;
};

struct RangeFaults {
  bool dead = false;
  bool stuck = false;  ///< the last range again and again
  bool doubled = false;
  bool swapped = false;    ///< of two measurements the second comes first
  bool corrupted = false;  ///< one bit of every frame is flipped
  bool not_a_number = false;
  bool too_far = false;      ///< the device says that it has no echo
  double offset_m = 0.0;     ///< added to every range
  int outlier_every = 0;     ///< every so many-th range is a wild one; 0: none
  std::int64_t late_ns = 0;  ///< on the bus that much later, where it gets its stamp
};

/// One number after the other, the same in every run.
class Dice {
 public:
  double uniform() {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return static_cast<double>(state_ >> 11U) * 0x1.0p-53;
  }

 private:
  std::uint64_t state_ = 1;
};

class SimulatedImu final : public SerialPort {
 public:
  /// The unit has been on for a while when the flight begins.
  SimulatedImu(const test::PlaneFlight& flight, std::int64_t t_start_ns);

  emulator::Stim300Emulator& unit() { return unit_; }
  ImuLineFaults faults;

  /// What the unit sends up to `t_ns` is on the line; `flight_time` is what the host's clock says.
  void run_until(std::int64_t t_ns, Time flight_time);
  bool has_bytes() const { return !line_.empty() || faults.gone; }

  Result<SerialChunk> read(std::span<std::uint8_t> buffer, Duration timeout) override;
  Status write(std::span<const std::uint8_t> bytes, Duration timeout) override;
  int last_error() const override;
  std::uint64_t reopens() const override { return 0; }  // `faults.gone` is a line that fails and stays open

 private:
  void put(const emulator::Bytes& bytes);

  static constexpr std::size_t kLineBuffer = 4096;  // what Linux keeps of a line that nobody reads
  emulator::Stim300Emulator unit_;
  std::int64_t t_ns_;
  Time flight_time_;
  std::deque<std::uint8_t> line_;
  emulator::Bytes held_;
};

/// Images are kept, because those of every flight are the same and cost more than the flight software. Frees them.
void forget_images();

class SimulatedCamera final : public CameraPort {
 public:
  static constexpr std::int64_t kPeriod_ns = 50'000'000;
  static constexpr std::int64_t kExposure_ns = 4'000'000;
  static constexpr std::int64_t kReadout_ns = 8'000'000;

  explicit SimulatedCamera(std::int64_t t_start_ns) : t_start_ns_(t_start_ns) {}

  CameraFaults faults;

  void run_until(std::int64_t t_ns, Time flight_time);
  bool has_frame() const { return !arrived_.empty(); }

  Result<CameraMode> start(const CameraMode& mode) override { return mode; }
  void stop() override {}
  Result<PortFrame> receive(Duration timeout) override;
  Result<Exposure> set_exposure(const Exposure& wanted) override { return wanted; }
  const CameraHealth& health() const override { return health_; }
  int last_error() const override { return 0; }

 private:
  using Pixels = std::vector<std::uint8_t>;
  struct Shot {
    PortFrame frame;
    Pixels pixels;
    std::int64_t t_arrival_ns = 0;
  };
  Shot shoot(std::int64_t t_end_ns, Time flight_time);
  void send(const Shot& shot);

  std::int64_t t_start_ns_;
  std::int64_t next_ = 0;
  Dice dice_;
  Pixels last_;
  std::deque<Shot> on_the_way_;
  std::deque<Shot> arrived_;
  Shot held_;
  bool holds_ = false;
  Shot taken_;
  CameraHealth health_;
};

class SimulatedRange final : public CanSocket {
 public:
  static constexpr std::int64_t kPeriod_ns = 40'000'000;

  SimulatedRange(const test::PlaneFlight& flight, std::int64_t t_start_ns) : flight_(flight), t_next_ns_(t_start_ns) {}

  RangeFaults faults;

  void run_until(std::int64_t t_ns, Time flight_time);
  bool has_frame() const { return !arrived_.empty(); }

  Status set_filters(std::span<const CanFilter> filters) override;
  Result<ReceivedCanFrame> receive(Duration timeout) override;
  Status send(const CanFrame&) override { return Status::kOk; }
  const CanHealth& health() const override { return health_; }
  int last_error() const override { return 0; }

 private:
  struct Transfer {
    std::int64_t t_arrival_ns = 0;
    std::vector<CanFrame> frames;
  };
  double reading_m(std::int64_t t_ns);
  Transfer measure(std::int64_t t_ns);

  const test::PlaneFlight& flight_;
  std::int64_t t_next_ns_;
  unsigned count_ = 0;
  Dice dice_;
  double last_m_ = 0.0;
  std::deque<Transfer> on_the_way_;
  std::deque<ReceivedCanFrame> arrived_;
  Transfer held_;
  bool holds_ = false;
  CanHealth health_;
};

/// The bus with a LIDAR-Lite v3 in place of the range finder on CAN. A transfer takes no time.
class SimulatedLidarLite final : public I2cBus {
 public:
  explicit SimulatedLidarLite(const test::PlaneFlight& flight);

  test::LidarLiteEmulator& unit() { return unit_; }
  void run_until(std::int64_t t_ns, Time flight_time);

  Result<Time> write(std::uint8_t address, std::span<const std::uint8_t> bytes) override;
  Result<Time> read(std::uint8_t address, std::span<std::uint8_t> bytes) override;
  bool is_gone() const override { return false; }
  int last_error() const override;

 private:
  test::LidarLiteEmulator unit_{test::LidarLiteEmulator::Kind::kV3};
  std::int64_t t_ns_ = 0;
  Time flight_time_;
};

}  // namespace plumb::faults
