#include "tools/decode/bytes.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "config/input_error.h"

namespace plumb::decode {

std::vector<std::uint8_t> read_bytes(const std::string& file) {
  const auto fail = [&file](const std::string& problem) {
    throw InputError(file + ": " + problem + ": " + std::strerror(errno));
  };
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> opened(nullptr, std::fclose);
  std::FILE* stream = stdin;
  if (file != "-") {
    opened.reset(std::fopen(file.c_str(), "rb"));
    stream = opened.get();
  }
  if (stream == nullptr) fail("cannot be opened");
  std::vector<std::uint8_t> bytes;
  std::array<std::uint8_t, 65536> buffer{};
  while (const std::size_t size = std::fread(buffer.data(), 1, buffer.size(), stream)) {
    bytes.insert(bytes.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size));
  }
  if (std::ferror(stream) != 0) fail("cannot be read");
  return bytes;
}

std::istringstream read_text(const std::string& file) {
  const std::vector<std::uint8_t> bytes = read_bytes(file);
  return std::istringstream(std::string(bytes.begin(), bytes.end()));
}

}  // namespace plumb::decode
