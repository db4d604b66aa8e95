#include "tools/replay/pending_file.h"

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "tools/replay/input_error.h"

namespace plumb::replay {

PendingFile::PendingFile(std::filesystem::path file) : file_(std::move(file)), temporary_(file_) {
  temporary_ += ".partial";
  std::error_code error;
  if (file_.has_parent_path()) std::filesystem::create_directories(file_.parent_path(), error);
  if (error) throw InputError(file_.parent_path().string() + ": cannot be made a folder: " + error.message());
  if (std::filesystem::is_directory(file_, error)) throw InputError(file_.string() + ": is a folder; expected a file");
  stream_ = std::fopen(temporary_.c_str(), "wb");
  if (stream_ == nullptr) throw InputError(temporary_.string() + ": cannot be written: " + std::strerror(errno));
}

PendingFile::~PendingFile() {
  if (stream_ != nullptr) std::fclose(stream_);
  std::error_code ignored;  // nothing more can be done about a file that will not go
  if (!committed_) std::filesystem::remove(temporary_, ignored);
}

void PendingFile::check() const {
  if (std::ferror(stream_) != 0) throw WriteError(file_);
}

void PendingFile::close() {
  check();
  if (std::fclose(std::exchange(stream_, nullptr)) != 0) throw WriteError(file_);
}

void PendingFile::commit() {
  std::filesystem::rename(temporary_, file_);
  committed_ = true;
}

}  // namespace plumb::replay
