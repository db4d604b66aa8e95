// A real subscriber on the other side of a real LCM connection.

#include "hal/linux/lcm_sink.h"
#include "hal/linux/lcm_source.h"

#include <gtest/gtest.h>
#include <lcm/lcm.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "fsw/app/publisher.h"
#include "test/unit/telemetry/sample_records.h"
#include "tools/replay/heap_counter.h"

namespace plumb {
namespace {

struct Received {
  std::string channel;
  std::vector<std::uint8_t> message;
};

void keep(const lcm_recv_buf_t* buffer, const char* channel, void* user) {
  const auto* data = static_cast<const std::uint8_t*>(buffer->data);
  static_cast<std::vector<Received>*>(user)->push_back({channel, {data, data + buffer->data_size}});
}

void expect_delivery(const std::string& url) {
  std::string error;
  const std::unique_ptr<LcmSink> sink = LcmSink::open(url, error);
  ASSERT_NE(sink, nullptr) << error;
  std::vector<Received> received;
  lcm_subscribe(sink->handle(), channel::kNavState, keep, &received);

  const NavStateRecord sent = test::sample_nav_state();
  Publisher publisher(*sink);
  publisher.publish(sent);
  publisher.publish(test::sample_health());  // nobody listens
  constexpr int kTimeout_ms = 2000;
  ASSERT_GT(lcm_handle_timeout(sink->handle(), kTimeout_ms), 0);
  ASSERT_EQ(received.size(), 1U);
  EXPECT_EQ(received[0].channel, "NAV_STATE");
  NavStateRecord back;
  ASSERT_EQ(decode(received[0].message, back), Status::kOk);
  EXPECT_EQ(back.state_hash, sent.state_hash);
  EXPECT_EQ(back.state.p_WI_m, sent.state.p_WI_m);
  EXPECT_EQ(publisher.sent(), 2U);
  EXPECT_EQ(publisher.lost(), 0U);
}

TEST(LcmSink, DeliversWithinTheProcess) { expect_delivery("memq://"); }

// Set by in_namespace.sh: packets to a multicast group are for a network made for the test, never for the host's.
const char* udp_url() { return std::getenv("PLUMB_TEST_LCM_URL"); }
constexpr const char* kNoNetwork = "runs in a network namespace of its own, see the test lcm_udp";

TEST(LcmUdp, Delivers) {
  if (udp_url() == nullptr) GTEST_SKIP() << kNoNetwork;
  expect_delivery(udp_url());
}

TEST(LcmUdp, ReachesASourceThatListensToItsChannel) {
  if (udp_url() == nullptr) GTEST_SKIP() << kNoNetwork;
  EXPECT_TRUE(stays_on_host(udp_url())) << "there is nothing but a loopback";
  std::string error;
  const std::unique_ptr<LcmSource> source = LcmSource::open(udp_url(), "COMMAND", error);
  const std::unique_ptr<LcmSink> sink = LcmSink::open(udp_url(), error);
  ASSERT_TRUE(source != nullptr && sink != nullptr) << error;
  EXPECT_EQ(source->receive(Duration::from_ms(1)).status(), Status::kNotReady);
  const std::vector<std::uint8_t> sent{1, 2, 3};
  ASSERT_EQ(sink->publish("COMMAND_ACK", std::vector<std::uint8_t>{9}), Status::kOk);
  ASSERT_EQ(sink->publish("COMMAND", sent), Status::kOk);
  const auto got = source->receive(Duration::from_ms(2000));
  ASSERT_TRUE(got.has_value());
  EXPECT_EQ(std::vector<std::uint8_t>(got->begin(), got->end()), sent);
}

TEST(LcmSource, KnowsNoRouteOfWhatIsNoAddress) {
  for (const char* url : {"", "memq://", "udpm://", "udpm://nowhere:7667?ttl=0"})
    EXPECT_FALSE(stays_on_host(url)) << url;
}

TEST(LcmSource, KnowsWhatLcmCanUseWhereThereIsARouteToIt) {
  for (const char* url : {"memq://", "udpm://239.255.76.67:7667?ttl=0"}) EXPECT_TRUE(is_lcm_url(url)) << url;
  for (const char* url : {"junk", "nonsense://x", "udpm://nowhere:7667", "udpm://127.0.0.1:7667"})
    EXPECT_FALSE(is_lcm_url(url)) << url;
}

TEST(LcmUdp, NeedsNoHeapOnceItIsOpen) {
  if (udp_url() == nullptr) GTEST_SKIP() << kNoNetwork;
  if (!replay::heap_calls_counted()) GTEST_SKIP() << "the sanitizers bring their own allocator";
  std::string error;
  const std::unique_ptr<LcmSink> sink = LcmSink::open(udp_url(), error);
  ASSERT_NE(sink, nullptr) << error;
  Publisher publisher(*sink);
  const NavStateRecord record = test::sample_nav_state();
  const std::uint64_t before = replay::heap_calls();
  for (int i = 0; i < 100; ++i) publisher.publish(record);
  EXPECT_EQ(replay::heap_calls(), before);
  EXPECT_EQ(publisher.lost(), 0U);
}

TEST(LcmUdp, CountsWhatTheTransportRefuses) {
  if (udp_url() == nullptr) GTEST_SKIP() << kNoNetwork;
  std::string error;
  const std::unique_ptr<LcmSink> sink = LcmSink::open(udp_url(), error);
  ASSERT_NE(sink, nullptr) << error;
  const std::string too_long(100, 'x');  // LCM's channels have 63 characters at most
  EXPECT_EQ(sink->publish(too_long.c_str(), {}), Status::kRejected);
  EXPECT_EQ(sink->publish("SHORT", {}), Status::kOk);
  EXPECT_EQ(sink->lost(), 1U);
}

TEST(LcmSink, SaysWhyAUrlIsOfNoUse) {
  std::string error;
  EXPECT_EQ(LcmSink::open("nonsense://x", error), nullptr);
  EXPECT_NE(error.find("nonsense://x"), std::string::npos);
}

class RefusingSink final : public TelemetrySink {
 public:
  Status publish(const char*, std::span<const std::uint8_t>) override { return Status::kRejected; }
  int last_error() const override { return 0; }
};

TEST(Publisher, CountsWhatIsLost) {
  RefusingSink sink;
  Publisher publisher(sink);
  publisher.publish(test::sample_timing());
  EXPECT_EQ(publisher.sent(), 0U);
  EXPECT_EQ(publisher.lost(), 1U);
}

}  // namespace
}  // namespace plumb
