#include "tools/replay/csv.h"

#include <charconv>
#include <utility>

#include "config/input_error.h"

namespace plumb::replay {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

template <typename T>
bool parse(std::string_view text, T& value) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return error == std::errc{} && stop == end;
}

}  // namespace

CsvReader::CsvReader(std::filesystem::path file) : file_(std::move(file)), stream_(file_) {
  if (!std::filesystem::is_regular_file(file_) || !stream_) {
    throw InputError(file_.string() + ": cannot be read; expected a CSV file");
  }
}

bool CsvReader::next() {
  while (std::getline(stream_, line_)) {
    ++line_number_;
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // some editors begin a file with it
    if (line_number_ == 1 && line_.starts_with(kByteOrderMark)) line_.erase(0, kByteOrderMark.size());
    const std::string_view row = trimmed(line_);
    if (row.empty() || row.front() == '#') continue;
    if (stream_.eof()) fail("no line end: the file looks cut short; expected one after the last row too");
    fields_.clear();
    std::size_t start = 0;
    for (std::size_t comma = row.find(','); comma != std::string_view::npos; comma = row.find(',', start)) {
      fields_.push_back(trimmed(row.substr(start, comma - start)));
      start = comma + 1;
    }
    fields_.push_back(trimmed(row.substr(start)));
    return true;
  }
  if (stream_.bad()) throw InputError(file_.string() + ": reading failed after line " + std::to_string(line_number_));
  return false;
}

void CsvReader::expect_columns(std::size_t least, std::size_t most, std::string_view content) const {
  if (fields_.size() >= least && fields_.size() <= most) return;
  const std::string count = least == most ? std::to_string(least) : "at least " + std::to_string(least);
  fail("expected " + count + " columns (" + std::string(content) + "), found " + std::to_string(fields_.size()));
}

double CsvReader::number(std::size_t column) const {
  double value = 0.0;
  if (!parse(fields_[column], value)) {
    fail("column " + std::to_string(column + 1) + ": expected a number, found '" + std::string(fields_[column]) + "'");
  }
  return value;
}

Time CsvReader::time() {
  std::int64_t ns = 0;
  if (!parse(fields_[0], ns) || ns < 0 || ns == Time::max().ns()) {
    fail("column 1: expected a time stamp in whole nanoseconds, found '" + std::string(fields_[0]) + "'");
  }
  const Time t = Time::from_ns(ns);
  if (t <= t_last_) {
    fail("time stamp " + std::to_string(ns) + " is not after " + std::to_string(t_last_.ns()) +
         " of the row before; expected increasing time stamps");
  }
  t_last_ = t;
  return t;
}

void CsvReader::fail(const std::string& message) const {
  throw InputError(file_.string() + " line " + std::to_string(line_number_) + ": " + message);
}

}  // namespace plumb::replay
