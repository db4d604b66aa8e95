// Every interleaving of a few pushes and pops, at every atomic access. The ring's atomics are replaced by ones that
// hand control back before each access; two fibers, one per side, are then stepped through all possible schedules. What
// this can not show is the effect of a weak memory order: every access here is sequentially consistent. The orders
// themselves are checked at the end of the file, and the stress test runs them on real threads.

#include <gtest/gtest.h>
#include <ucontext.h>

#include <algorithm>
#include <array>
#include <functional>
#include <utility>
#include <vector>

#include "fsw/base/spsc_ring.h"

namespace plumb {
namespace {

/// Two fibers on one thread. Each runs until its next pause(), in the order a schedule decides.
class FiberPair {
 public:
  /// `choose` is asked, while both can go on, which one does (0 or 1).
  void run(std::function<void()> first, std::function<void()> second, const std::function<int()>& choose) {
    bodies_ = {std::move(first), std::move(second)};
    done_ = {false, false};
    for (int i = 0; i < 2; ++i) {
      getcontext(&fibers_[i]);
      fibers_[i].uc_stack.ss_sp = stacks_[i].data();
      fibers_[i].uc_stack.ss_size = stacks_[i].size();
      fibers_[i].uc_link = &scheduler_;
      makecontext(&fibers_[i], &FiberPair::enter, 0);
    }
    running_ = this;
    while (!done_[0] || !done_[1]) {
      current_ = done_[0] ? 1 : done_[1] ? 0 : choose();
      swapcontext(&scheduler_, &fibers_[current_]);
    }
    running_ = nullptr;
  }

  /// Called by the ring's atomics; does nothing outside run().
  static void pause() {
    if (running_ == nullptr) return;
    swapcontext(&running_->fibers_[running_->current_], &running_->scheduler_);
  }

 private:
  static void enter() {
    running_->bodies_[running_->current_]();
    running_->done_[running_->current_] = true;
  }

  static inline FiberPair* running_ = nullptr;
  std::array<std::function<void()>, 2> bodies_;
  std::array<bool, 2> done_{};
  std::array<ucontext_t, 2> fibers_{};
  std::array<std::array<char, 64 * 1024>, 2> stacks_{};
  ucontext_t scheduler_{};
  int current_ = 0;
};

/// Depth-first enumeration of all sequences of binary choices.
class Choices {
 public:
  int next() {
    if (position_ == taken_.size()) taken_.push_back(0);
    return taken_[position_++];
  }
  /// Moves to the next unseen sequence; false when there is none.
  bool advance() {
    position_ = 0;
    while (!taken_.empty() && taken_.back() == 1) taken_.pop_back();
    if (taken_.empty()) return false;
    taken_.back() = 1;
    return true;
  }

 private:
  std::vector<int> taken_;
  std::size_t position_ = 0;
};

template <typename T>
class SteppedAtomic {
 public:
  SteppedAtomic(T value) : value_(value) {}
  T load(std::memory_order) const {
    FiberPair::pause();
    return value_;
  }
  void store(T value, std::memory_order) {
    FiberPair::pause();
    value_ = value;
  }

 private:
  T value_;
};

/// One schedule: the producer pushes 1, 2, ... and the consumer polls, each a fixed number of times.
struct Scenario {
  static constexpr std::size_t kCapacity = 2;

  SpscRing<int, kCapacity, SteppedAtomic> ring;
  std::vector<int> accepted;
  std::vector<int> received;
  std::uint64_t refused = 0;
  int broken = 0;

  void produce(int pushes) {
    for (int item = 1; item <= pushes; ++item) {
      const bool room = accepted.size() - received.size() < kCapacity;
      if (ok(ring.push(item))) {
        accepted.push_back(item);
      } else {
        ++refused;
        if (room) ++broken;  // the consumer can only have made more of it
      }
    }
  }
  void consume(int polls) {
    for (int i = 0; i < polls; ++i) {
      const bool ready = accepted.size() > received.size();
      int item = 0;
      if (ring.pop(item)) {
        received.push_back(item);
      } else if (ready) {
        ++broken;  // only the consumer takes, so the item must still be there
      }
    }
  }
  bool consistent() {
    int item = 0;
    while (ring.pop(item)) received.push_back(item);
    return broken == 0 && received == accepted && ring.overflows() == refused;
  }
};

long explore(int before, int pushes, int polls) {
  FiberPair fibers;
  Choices choices;
  long schedules = 0;
  do {
    Scenario scenario;
    scenario.produce(before);
    scenario.accepted.reserve(8);
    fibers.run([&] { scenario.produce(pushes); }, [&] { scenario.consume(polls); }, [&] { return choices.next(); });
    ++schedules;
    if (!scenario.consistent()) {
      ADD_FAILURE() << "schedule " << schedules << " of " << pushes << " pushes and " << polls << " polls";
      return schedules;
    }
  } while (choices.advance());
  return schedules;
}

TEST(SpscRingInterleaving, FromEmpty) {
  EXPECT_GT(explore(0, 2, 2), 1'000);
  EXPECT_GT(explore(0, 2, 3), 1'000);
}

TEST(SpscRingInterleaving, FromHalfFull) { EXPECT_GT(explore(1, 2, 2), 1'000); }

TEST(SpscRingInterleaving, FromFull) {
  EXPECT_GT(explore(2, 2, 2), 1'000);
  EXPECT_GT(explore(2, 3, 1), 1'000);
}

/// Notes the orders of the accesses, in sequence.
template <typename T>
class NotingAtomic {
 public:
  static inline std::vector<std::memory_order> loads;
  static inline std::vector<std::memory_order> stores;

  NotingAtomic(T value) : value_(value) {}
  T load(std::memory_order order) const {
    loads.push_back(order);
    return value_;
  }
  void store(T value, std::memory_order order) {
    stores.push_back(order);
    value_ = value;
  }

 private:
  T value_;
};

TEST(SpscRingMemoryOrder, EverySideAcquiresTheOthersCountAndReleasesItsOwn) {
  using Noting = NotingAtomic<std::uint64_t>;
  SpscRing<int, 2, NotingAtomic> ring;
  const auto acquires = [] {
    return std::count(Noting::loads.begin(), Noting::loads.end(), std::memory_order_acquire);
  };
  const std::vector<std::memory_order> one_release{std::memory_order_release};

  ASSERT_EQ(ring.push(1), Status::kOk);
  EXPECT_EQ(acquires(), 1);
  EXPECT_EQ(Noting::stores, one_release);

  Noting::loads.clear();
  Noting::stores.clear();
  int out = 0;
  ASSERT_TRUE(ring.pop(out));
  EXPECT_EQ(acquires(), 1);
  EXPECT_EQ(Noting::stores, one_release);
}

}  // namespace
}  // namespace plumb
