#include "tools/replay/pending_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "tools/replay/input_error.h"

namespace plumb::replay {

FileLock::~FileLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

bool FileLock::take(const std::filesystem::path& file) {
  descriptor_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) return false;
  // A file system that knows no locks is no reason to write nothing.
  return ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

PendingFile::PendingFile(std::filesystem::path file) : file_(std::move(file)), temporary_(file_) {
  temporary_ += ".partial";
  std::error_code error;
  if (file_.has_parent_path()) std::filesystem::create_directories(file_.parent_path(), error);
  if (error) throw InputError(file_.parent_path().string() + ": cannot be made a folder: " + error.message());
  if (std::filesystem::is_directory(file_, error)) throw InputError(file_.string() + ": is a folder; expected a file");
  const bool locked = lock_.take(temporary_);
  if (!locked && errno == EWOULDBLOCK) {
    throw InputError(file_.string() + ": is being written already; expected a name that no other run or option uses");
  }
  stream_ = locked ? std::fopen(temporary_.c_str(), "wb") : nullptr;
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
  std::error_code error;
  std::filesystem::rename(temporary_, file_, error);
  if (error) throw WriteError(file_, "cannot be given its name: " + error.message());
  committed_ = true;
}

}  // namespace plumb::replay
