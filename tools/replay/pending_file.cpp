#include "tools/replay/pending_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "config/input_error.h"

namespace plumb::replay {
namespace {

namespace fs = std::filesystem;

void expect_no_input(const fs::path& file, std::span<const fs::path> inputs) {
  std::error_code error;
  const fs::path written = fs::weakly_canonical(file, error);
  for (const fs::path& input : inputs) {
    const fs::path read = fs::weakly_canonical(input, error);
    const bool within = std::mismatch(read.begin(), read.end(), written.begin(), written.end()).first == read.end();
    if (!within && !fs::equivalent(file, input, error)) continue;
    throw InputError(file.string() + ": would be written over what is read, " + input.string() +
                     "; expected another name");
  }
}

}  // namespace

FileLock::~FileLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

bool FileLock::take(const fs::path& file) {
  descriptor_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) return false;
  // A file system that knows no locks is no reason to write nothing.
  return ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

PendingFile::PendingFile(fs::path file, std::span<const fs::path> inputs) : file_(std::move(file)), temporary_(file_) {
  temporary_ += ".partial";
  expect_no_input(file_, inputs);
  expect_no_input(temporary_, inputs);
  std::error_code error;
  if (file_.has_parent_path()) fs::create_directories(file_.parent_path(), error);
  if (error) throw InputError(file_.parent_path().string() + ": cannot be made a folder: " + error.message());
  const fs::file_status there = fs::status(file_, error);
  if (fs::exists(there) && !fs::is_regular_file(there)) {
    throw InputError(file_.string() + ": is " + (fs::is_directory(there) ? "a folder" : "a device or pipe") +
                     "; expected a new name or that of a file");
  }
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
  if (!committed_) fs::remove(temporary_, ignored);
}

void PendingFile::check() const {
  if (std::ferror(stream_) != 0) throw WriteError(file_);
}

void PendingFile::close() {
  check();
  if (std::fclose(std::exchange(stream_, nullptr)) != 0) throw WriteError(file_);
}

void PendingFile::remove_earlier() const {
  std::error_code error;
  fs::remove(file_, error);
  if (error) throw WriteError(file_, "cannot be replaced: " + error.message());
}

void PendingFile::commit() {
  std::error_code error;
  fs::rename(temporary_, file_, error);
  if (error) throw WriteError(file_, "cannot be given its name: " + error.message());
  committed_ = true;
}

}  // namespace plumb::replay
