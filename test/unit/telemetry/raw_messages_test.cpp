#include "fsw/telemetry/raw_messages.h"

#include <gtest/gtest.h>

#include <array>

namespace plumb {
namespace {

template <class Record>
Record there_and_back(const Record& record) {
  std::array<std::uint8_t, kMaxMessageBytes> buffer{};
  const Result<std::size_t> size = encode(record, buffer);
  Record back;
  EXPECT_EQ(decode(MessageBytes(buffer.data(), size.value()), back), Status::kOk);
  EXPECT_EQ(decode(MessageBytes(buffer.data(), size.value() - 1), back), Status::kInvalidValue);
  EXPECT_EQ(encode(record, MessageBuffer(buffer.data(), size.value() - 1)).status(), Status::kFull);
  return back;
}

template <class Bytes>
Bytes bytes_of(std::size_t count) {
  Bytes bytes;
  bytes.resize(count);
  for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<std::uint8_t>(255 - i);
  return bytes;
}

TEST(RawMessages, BytesOfALineComeBack) {
  for (const std::size_t count : {0UL, 1UL, 256UL}) {
    const RawBytes raw{.t = Time::from_ns(-5), .bytes = bytes_of<decltype(RawBytes::bytes)>(count)};
    const RawBytes back = there_and_back(raw);
    EXPECT_EQ(back.t, raw.t);
    ASSERT_EQ(back.bytes.size(), count);
    EXPECT_TRUE(std::equal(back.bytes.begin(), back.bytes.end(), raw.bytes.begin()));
  }
}

TEST(RawMessages, TransfersAndCanFramesComeBack) {
  const RawTransfer transfer{.t_stop = Time::from_ns(1),
                             .duration = Duration::from_us(300),
                             .address = 0x62,
                             .is_read = true,
                             .acknowledged = true,
                             .bytes = bytes_of<decltype(RawTransfer::bytes)>(8)};
  const RawTransfer transferred = there_and_back(transfer);
  EXPECT_EQ(transferred.duration, transfer.duration);
  EXPECT_EQ(transferred.address, 0x62);
  EXPECT_TRUE(transferred.is_read && transferred.acknowledged);
  EXPECT_EQ(transferred.bytes[7], 248);
  const RawCanFrame frame{.t = Time::from_ns(2),
                          .id = 0x1FFF'FFFF,
                          .is_extended = true,
                          .bytes = bytes_of<decltype(RawCanFrame::bytes)>(3)};
  const RawCanFrame framed = there_and_back(frame);
  EXPECT_EQ(framed.id, frame.id);
  EXPECT_TRUE(framed.is_extended);
  EXPECT_EQ(framed.bytes.size(), 3U);
}

}  // namespace
}  // namespace plumb
