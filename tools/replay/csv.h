#pragma once
// Number tables as the ASL format has them: comma-separated, '#' comments, LF or CRLF. Every fault names file and line.

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "fsw/base/time.h"

namespace plumb::replay {

class CsvReader {
 public:
  /// Throws InputError when the file cannot be opened.
  explicit CsvReader(std::filesystem::path file);

  /// Moves to the next row, past blank lines and comments. False at the end of the file. Throws InputError at a last
  /// row without a line end: nobody can tell whether its last number is whole.
  bool next();
  std::size_t columns() const { return fields_.size(); }
  /// Throws InputError unless the row has from `least` to `most` columns.
  void expect_columns(std::size_t least, std::size_t most, std::string_view content) const;
  std::string_view text(std::size_t column) const { return fields_[column]; }
  /// "nan" and "inf" are numbers here; whether they are welcome is for the caller to say.
  double number(std::size_t column) const;
  /// Column 0 as a time stamp in ns, at least 0 and after that of the row before.
  Time time();
  /// "FILE line N: message".
  [[noreturn]] void fail(const std::string& message) const;

 private:
  std::filesystem::path file_;
  std::ifstream stream_;
  std::string line_;
  std::vector<std::string_view> fields_;  ///< into line_
  std::size_t line_number_ = 0;
  Time t_last_ = Time::never();
};

}  // namespace plumb::replay
